"""Walks in the axes of their path: a robot that turns, seen as one that walks straight on.

The equations of a model with a linear encoder hold for a robot that looks along x. A reference is
unrolled: its way is summed along its heading, its velocities are turned back by the heading, its yaw
becomes 0. A measurement keeps its distance from the reference, turned back by the same angle.
"""

import numpy as np

X, Y, YAW = 12, 13, 17


class Path:
    """The place (rows, 2) and heading (rows,) of a reference, and where its unrolled way is."""

    def __init__(self, time_s, x):
        self.time_s, self.place, self.yaw = time_s, x[:, X : Y + 1], np.unwrap(x[:, YAW])
        steps = np.diff(self.place, axis=0)
        middle = 0.5 * (self.yaw[1:] + self.yaw[:-1])
        self.way = np.vstack([np.zeros(2), np.cumsum(turned(steps, -middle), axis=0)])

    def unrolled(self, x, dx):
        """The reference (rows, 18) and its rates in the axes of the path."""
        x, dx = x.copy(), dx.copy()
        dx[:, X : Y + 1] = turned(dx[:, X : Y + 1], -self.yaw)
        dx[:, YAW] -= np.gradient(self.yaw, self.time_s)
        x[:, X : Y + 1] = self.way
        x[:, YAW] = 0.0
        return x, dx

    def measured(self, time_s, x, dx):
        """A measurement (18,) in the axes of the path at a time."""
        of = [np.interp(time_s, self.time_s, values) for values in self._columns()]
        yaw, place, way, rate = of[0], np.array(of[1:3]), np.array(of[3:5]), of[5]
        x, dx = x.copy(), dx.copy()
        x[X : Y + 1] = way + turned(x[None, X : Y + 1] - place, -yaw)[0]
        dx[X : Y + 1] = turned(dx[None, X : Y + 1], -yaw)[0]
        x[YAW] = (x[YAW] - yaw + np.pi) % (2.0 * np.pi) - np.pi
        dx[YAW] -= rate
        return x, dx

    def _columns(self):
        rate = np.gradient(self.yaw, self.time_s)
        return [self.yaw, *self.place.T, *self.way.T, rate]


def turned(vectors, angles):
    """(rows, 2) vectors turned by angles (rad)."""
    c, s = np.cos(angles), np.sin(angles)
    x, y = vectors.T
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)
