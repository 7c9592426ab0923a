"""Reference motions in time: a quintic between two points, a spline through many, and a thrust."""

import numpy as np


class Quintic:
    """From (start, velocity) to rest at `goal` with zero acceleration at both ends.

    Waits `wait_s` first; stays at the goal afterwards.
    """

    def __init__(self, start, velocity, goal, duration_s, wait_s=0.0):
        self.start, self.velocity, self.goal = (np.array(v, float) for v in (start, velocity, goal))
        self.duration_s, self.wait_s = duration_s, wait_s

    def progress(self, time_s):
        """0 to 1, smoothly."""
        t = np.clip((time_s - self.wait_s) / self.duration_s, 0.0, 1.0)
        return t**3 * (10 - 15 * t + 6 * t * t)

    def at(self, time_s):
        """Position, velocity, acceleration."""
        T = self.duration_s
        t = np.clip((time_s - self.wait_s) / T, 0.0, 1.0)
        way, pull = self.goal - self.start, self.velocity * T
        position = (
            self.start
            + way * t**3 * (10 - 15 * t + 6 * t * t)
            + pull * t * (1 - 6 * t**2 + 8 * t**3 - 3 * t**4)
        )
        velocity = (
            way * 30 * t**2 * (1 - t) ** 2 + pull * (1 - 18 * t**2 + 32 * t**3 - 15 * t**4)
        ) / T
        acceleration = (
            way * 60 * t * (1 - 3 * t + 2 * t * t) + pull * t * (-36 + 96 * t - 60 * t * t)
        ) / T**2
        return position, velocity, acceleration


class Cubic:
    """From (start, velocity) to rest at `goal`; turns round at once, unlike the quintic."""

    def __init__(self, start, velocity, goal, duration_s):
        self.start, self.velocity, self.goal = (np.array(v, float) for v in (start, velocity, goal))
        self.duration_s = duration_s

    def at(self, time_s):
        """Position, velocity, acceleration."""
        T = self.duration_s
        t = np.clip(time_s / T, 0.0, 1.0)
        way, pull = self.goal - self.start, self.velocity * T
        position = self.start + way * t * t * (3 - 2 * t) + pull * t * (1 - t) ** 2
        velocity = (6 * way * t * (1 - t) + pull * (1 - t) * (1 - 3 * t)) / T
        acceleration = (6 * way * (1 - 2 * t) + pull * (6 * t - 4)) / T**2
        return position, velocity, acceleration


RAMP_UP, RAMP_DOWN = 0.25, 0.85
GRID = np.linspace(0.0, 1.0, 2001)


def _integral(values):
    step = GRID[1] - GRID[0]
    return np.concatenate([[0.0], np.cumsum(0.5 * step * (values[1:] + values[:-1]))])


_RISE = np.clip(GRID / RAMP_UP, 0.0, 1.0)
_RELEASE = np.clip((GRID - RAMP_DOWN) / (1.0 - RAMP_DOWN), 0.0, 1.0)
_PUSH = _RISE * _RISE * (3 - 2 * _RISE) * (1.0 - _RELEASE)
_PUSH_V, _RELEASE_V = _integral(_PUSH), _integral(_RELEASE)
_PUSH_X, _RELEASE_X = _integral(_PUSH_V), _integral(_RELEASE_V)


class Thrust:
    """Acceleration that ramps up over a quarter of its time, holds, and lets the floor go.

    At the end the vertical acceleration is that of gravity, so the feet carry
    nothing when they leave; the velocity is `velocity`, the rise is `rise_m`,
    which fixes the duration.
    """

    def __init__(self, start, velocity, rise_m):
        self.start, velocity = np.array(start, float), np.array(velocity, float)
        g = np.array([0.0, 0.0, 9.81])
        # rise = velocity T a + g T^2 b
        a = _PUSH_X[-1] / _PUSH_V[-1]
        b = 9.81 * (_RELEASE_V[-1] * a - _RELEASE_X[-1])
        vz = velocity[2]
        self.duration_s = (-vz * a + np.sqrt((vz * a) ** 2 + 4 * b * rise_m)) / (2 * b)
        self.push = (velocity / self.duration_s + g * _RELEASE_V[-1]) / _PUSH_V[-1]
        self.gravity = g

    def at(self, time_s):
        """Position, velocity, acceleration."""
        T = self.duration_s
        t = np.clip(time_s / T, 0.0, 1.0)
        push, push_v, push_x = (np.interp(t, GRID, v) for v in (_PUSH, _PUSH_V, _PUSH_X))
        let, let_v, let_x = (np.interp(t, GRID, v) for v in (_RELEASE, _RELEASE_V, _RELEASE_X))
        return (
            self.start + T * T * (self.push * push_x - self.gravity * let_x),
            T * (self.push * push_v - self.gravity * let_v),
            self.push * push - self.gravity * let,
        )


class QuinticSpline:
    """Through knots (time s, position, velocity, acceleration), a quintic between each two; stays
    at the last position afterwards.

    Positions are arrays of one shape; 0.0 stands for a velocity or an acceleration of zeros.
    """

    # Rows: position, velocity, acceleration at the start and at the end of a unit interval.
    _BOUNDARY = np.array(
        [
            [1, 0, 0, 0, 0, 0],
            [0, 1, 0, 0, 0, 0],
            [0, 0, 2, 0, 0, 0],
            [1, 1, 1, 1, 1, 1],
            [0, 1, 2, 3, 4, 5],
            [0, 0, 2, 6, 12, 20],
        ],
        dtype=float,
    )

    def __init__(self, knots):
        self.times = np.array([knot[0] for knot in knots])
        shape = np.shape(knots[0][1])
        values = [[np.broadcast_to(v, shape) for v in knot[1:]] for knot in knots]
        self.last = np.array(values[-1][0], float)
        self.pieces = []
        for index, span in enumerate(np.diff(self.times)):
            ends = [
                value * span**order
                for knot in (values[index], values[index + 1])
                for order, value in enumerate(knot)
            ]
            self.pieces.append(np.linalg.solve(self._BOUNDARY, np.array(ends).reshape(6, -1)))
        self.shape = shape

    def at(self, time_s):
        """Position, velocity, acceleration."""
        if time_s >= self.times[-1]:
            return self.last, np.zeros(self.shape), np.zeros(self.shape)
        piece = max(int(np.searchsorted(self.times, time_s, side="right")) - 1, 0)
        span = self.times[piece + 1] - self.times[piece]
        t = max((time_s - self.times[piece]) / span, 0.0)
        powers = t ** np.arange(6)
        order = np.arange(1, 6)
        first = np.concatenate([[0.0], order * powers[:5]]) / span
        second = np.concatenate([[0.0, 0.0], order[1:] * order[:-1] * powers[:4]]) / span**2
        coefficients = self.pieces[piece]
        return tuple((row @ coefficients).reshape(self.shape) for row in (powers, first, second))
