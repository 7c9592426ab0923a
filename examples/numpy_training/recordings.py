"""Recordings as batches: equations (22) and (23), phases, resampling to multiples of 100 rows, scaling by 0.1."""

import csv
import gzip

import numpy as np

LEGS = ("fr", "fl", "rr", "rl")
JOINTS = [f"{leg}.{joint}" for leg in LEGS for joint in ("hx", "hy", "kn")]
BODY = [("linear", axis) for axis in "xyz"] + [("angular", axis) for axis in "xyz"]
HIP_M, LINK_M = 0.0847, 0.213
ROWS, LEAST_SPAN = 100, 5


def read(path):
    """State, velocity, acceleration (rows are samples), torques and contact of one file."""
    opener = gzip.open if str(path).endswith("gz") else open
    with opener(path, "rt") as file:
        first = file.readline()
        separator = ";" if ";" in first else ","
        names = next(csv.reader([first.strip()], delimiter=separator))
        text = file.read()
    if separator == ";":
        text = text.replace(",", ".").replace(";", ",")
    table = np.array([row.split(",") for row in text.split()], dtype=float)
    column = {name: table[:, i] for i, name in enumerate(names)}

    def block(kind):
        body = [column[f"Body {motion} {kind} {axis}"] for motion, axis in BODY]
        return np.array([column[f"{joint} {kind}"] for joint in JOINTS] + body).T

    torque = np.array([column[f"{joint} Torque"] for joint in JOINTS]).T
    feet = np.array([column[f"{leg} Foot"] for leg in LEGS]).T > 0.5
    return column["Time"], block("Position"), block("Velocity"), block("Acceleration"), torque, feet


def wrench(joints, torque, feet):
    """[F_lin; F_ang] from torques and contact, samples in rows."""
    total = np.zeros((len(joints), 6))
    for leg in range(4):
        side = -1 if leg % 2 == 0 else 1
        hx, hy, kn = joints[:, 3 * leg : 3 * leg + 3].T
        down = -LINK_M * (np.cos(hy) + np.cos(hy + kn))
        x = -LINK_M * (np.sin(hy) + np.sin(hy + kn))
        sine, cosine = np.sin(hx), np.cos(hx)
        foot = np.stack([x, side * HIP_M * cosine - down * sine, side * HIP_M * sine + down * cosine], 1)
        jacobian = np.zeros((len(joints), 3, 3))
        jacobian[:, 1, 0], jacobian[:, 2, 0] = -foot[:, 2], foot[:, 1]
        for i, (dx, ddown) in enumerate([(down, -x), (-LINK_M * np.cos(hy + kn), LINK_M * np.sin(hy + kn))]):
            jacobian[:, :, 1 + i] = np.stack([dx, -ddown * sine, ddown * cosine], 1)
        tau = torque[:, 3 * leg : 3 * leg + 3, None]
        force = -np.linalg.solve(jacobian.transpose(0, 2, 1), tau)[:, :, 0] * feet[:, [leg]]
        total[:, :3] += force
        total[:, 3:] += np.cross(foot, force)
    return total


def spans(contact):
    """(contact or not, start, end) of runs; runs shorter than five samples join the one before."""
    edges = [0, *(np.flatnonzero(np.diff(contact.astype(int))) + 1), len(contact)]
    runs = []
    for start, end in zip(edges[:-1], edges[1:]):
        if runs and (end - start < LEAST_SPAN or runs[-1][0] == contact[start]):
            runs[-1][2] = end
        else:
            runs.append([bool(contact[start]), start, end])
    return runs


def batches(paths):
    """Batches (x, dx, ddx, u) of 100 rows for contact and for flight, scaled by 0.1."""
    result = {True: [], False: []}
    for path in paths:
        time, x, dx, ddx, torque, feet = read(path)
        for contact, start, end in spans(feet.any(1)):
            rows = -(-(end - start) // ROWS) * ROWS
            where = np.linspace(time[start], time[end - 1], rows)

            def resample(values):
                return np.array([np.interp(where, time[start:end], c) for c in values[start:end].T]).T

            down = resample(feet.astype(float)) > 0.5
            joints, tau = resample(x[:, :12]), resample(torque)
            u = np.hstack([tau, wrench(joints, tau, down)])
            arrays = [0.1 * a for a in (resample(x), resample(dx), resample(ddx), u)]
            for first in range(0, rows, ROWS):
                result[contact].append([np.ascontiguousarray(a[first : first + ROWS]) for a in arrays])
    return result[True], result[False]
