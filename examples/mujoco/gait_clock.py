"""The clock of a gait: scheduled stance of every foot, and its progress through stance or swing."""

from dataclasses import dataclass

import numpy as np

# Share of a stride by which each leg (fr, fl, rr, rl) is ahead of the first.
LEADS = {
    "trot": (0.0, 0.5, 0.5, 0.0),
    "crawl": (0.5, 0.0, 0.75, 0.25),
    "pronk": (0.0, 0.0, 0.0, 0.0),
}


@dataclass(frozen=True)
class Gait:
    """A name of `LEADS`, strides per second, and the share of a stride that a foot stands."""

    name: str = "trot"
    frequency_hz: float = 2.7
    duty: float = 0.48

    @property
    def stance_s(self):
        """Time that a foot stands (s)."""
        return self.duty / self.frequency_hz

    @property
    def swing_s(self):
        """Time that a foot is in the air (s)."""
        return (1.0 - self.duty) / self.frequency_hz

    @property
    def together(self):
        """Least number of feet in scheduled stance, flight left out."""
        return {"trot": 2, "crawl": 3, "pronk": 4}[self.name]

    def at(self, time_s):
        """(4,) scheduled stance; (4,) progress from 0 to 1 through stance or swing.

        Before time 0 all feet stand. At time 0 the first leg lifts; in a pronk the stance begins.
        """
        if time_s < 0.0:
            return np.ones(4, bool), np.zeros(4)
        first = 0.0 if self.name == "pronk" else self.duty
        phase = (first + time_s * self.frequency_hz + np.array(LEADS[self.name])) % 1.0
        standing = phase < self.duty
        progress = np.where(standing, phase / self.duty, (phase - self.duty) / (1.0 - self.duty))
        return standing, progress

    def bounce(self, time_s):
        """Height of the trunk over its mean in stance (m), its velocity and acceleration.

        Zero for gaits without scheduled flight; else a parabola from one flight into the next.
        """
        groups = len(set(LEADS[self.name]))
        flight_s = (1.0 / groups - self.duty) / self.frequency_hz
        if time_s < 0.0 or flight_s <= 0.0:
            return 0.0, 0.0, 0.0
        standing, progress = self.at(time_s)
        way = progress[standing].max() if standing.any() else 0.0
        speed = 0.5 * 9.81 * flight_s
        height = speed * self.stance_s * (way * (way - 1.0) + 1.0 / 6.0)
        return height, speed * (2.0 * way - 1.0), 2.0 * speed / self.stance_s


def cycloid(start, goal, height_m, progress):
    """(3,) point of a swing from `start` to `goal` (m) with a peak this high above the line."""
    way = progress - np.sin(2 * np.pi * progress) / (2 * np.pi)
    point = start + way * (goal - start)
    point[2] += 0.5 * height_m * (1.0 - np.cos(2 * np.pi * progress))
    return point
