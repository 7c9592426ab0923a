"""Jumps made of recorded ones without a model: baselines of planned jumps.

A recorded jump is cut at its landmarks (crouch, thrust, flight, landing) and sampled at equal
shares of each part's duration, so that jumps of different timing can be averaged and regressed.
"""

from dataclasses import dataclass

import numpy as np

from assessment import longest_flight
from followers import Jump
from simulation import CONTROL_STEP_S

THRUST_SPEED = 0.1
NODES = 60
RIDGE = 3.0
NEAREST = 3
X, Z = 12, 14


@dataclass(frozen=True)
class Goal:
    """Goal of a jump: distance and rise of the trunk, m."""

    name: str
    distance_m: float
    apex_m: float


@dataclass(frozen=True)
class Sampled:
    """A jump in parts: durations (parts,), x, dx (parts, NODES, 18), torques (parts, NODES, 12)."""

    durations_s: np.ndarray
    x: np.ndarray
    dx: np.ndarray
    torque_nm: np.ndarray

    def __add__(self, other):
        return Sampled(*(getattr(self, f) + getattr(other, f) for f in self.__dataclass_fields__))

    def __mul__(self, factor):
        return Sampled(*(getattr(self, f) * factor for f in self.__dataclass_fields__))


def reached(jump):
    """(distance, rise, start height) of a recorded jump, m."""
    height = jump.x[:, Z]
    return np.array([jump.x[-1, X] - jump.x[0, X], height.max() - height[0], height[0]])


def sampled(jump):
    """The parts of a recorded jump."""
    first, last = longest_flight(jump.feet)
    slow = np.flatnonzero(jump.dx[:first, Z] <= THRUST_SPEED)
    borders = [0, int(slow[-1]) + 1, first, last, len(jump.time_s) - 1]
    parts = {"durations_s": [], "x": [], "dx": [], "torque_nm": []}
    for start, end in zip(borders, borders[1:]):
        at = np.linspace(start, end - (0 if end == borders[-1] else 1e-6), NODES)
        parts["durations_s"].append(jump.time_s[end] - jump.time_s[start])
        for name in ("x", "dx", "torque_nm"):
            rows = getattr(jump, name)
            here = np.floor(at).astype(int)
            following = np.minimum(here + 1, len(rows) - 1)
            share = (at - here)[:, None]
            # Torques of the last sample of a part are not mixed with the next part's.
            share = share * (following < end)[:, None] if name == "torque_nm" else share
            parts[name].append(rows[here] + share * (rows[following] - rows[here]))
    return Sampled(**{name: np.array(values) for name, values in parts.items()})


def as_jump(name, parts):
    """The jump of sampled parts, every 2 ms; in the third part no foot is on the floor."""
    ends = np.cumsum(parts.durations_s)
    times = np.arange(int(ends[-1] / CONTROL_STEP_S) + 1) * CONTROL_STEP_S
    rows = {"x": [], "dx": [], "torque_nm": [], "feet": []}
    for time in times:
        part = min(int(np.searchsorted(ends, time, side="right")), len(ends) - 1)
        start = ends[part] - parts.durations_s[part]
        at = (time - start) / parts.durations_s[part] * (NODES - 1)
        here = min(int(at), NODES - 2)
        for column in ("x", "dx", "torque_nm"):
            pair = getattr(parts, column)[part, here : here + 2]
            rows[column].append(pair[0] + (at - here) * (pair[1] - pair[0]))
        rows["feet"].append([part != 2] * 4)
    return Jump(name, times, **{column: np.array(values) for column, values in rows.items()})


class Recorded:
    """The training jumps, and trajectories made of them for a goal."""

    def __init__(self, jumps):
        self.jumps = jumps
        self.parts = [sampled(jump) for jump in jumps]
        self.goals = np.array([reached(jump) for jump in jumps])
        self.mean, self.std = self.goals.mean(axis=0), self.goals.std(axis=0)

    def by_distance(self, goal):
        """Numbers of the jumps, the nearest in distance and rise first; and how far each is."""
        wanted = np.array([goal.distance_m, goal.apex_m])
        far = np.linalg.norm((self.goals[:, :2] - wanted) / self.std[:2], axis=1)
        return np.argsort(far), far

    def nearest(self, goal):
        """The recorded jump nearest to the goal."""
        return self.jumps[self.by_distance(goal)[0][0]]

    def blend(self, goal):
        """The mean of the three nearest, weighted by one over how far they are."""
        order, far = self.by_distance(goal)
        chosen = order[:NEAREST]
        weights = 1.0 / np.maximum(far[chosen], 1e-3)
        weights /= weights.sum()
        parts = [self.parts[k] * w for k, w in zip(chosen, weights, strict=True)]
        return as_jump("blend", parts[0] + parts[1] + parts[2])

    def regression(self, goal, start_height_m):
        """The ridge regression of all jumps over distance, rise and height at the start."""
        features = self.features(self.goals)
        ridge = np.diag([0.0, RIDGE, RIDGE, RIDGE])
        solution = np.linalg.solve(features.T @ features + ridge, features.T)
        at = self.features(np.array([[goal.distance_m, goal.apex_m, start_height_m]]))[0]
        weights = at @ solution
        parts = self.parts[0] * weights[0]
        for part, weight in zip(self.parts[1:], weights[1:], strict=True):
            parts = parts + part * weight
        return as_jump("regression", parts)

    def features(self, goals):
        """(goals, 4): one, and the three numbers of each goal, normalised."""
        return np.hstack([np.ones((len(goals), 1)), (goals - self.mean) / self.std])
