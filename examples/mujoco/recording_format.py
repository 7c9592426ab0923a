"""The recording's CSV: 71 columns, `;` between them, decimal comma, gzip.

Columns: Time; position, velocity, acceleration of each of the 18 coordinates;
12 joint torques; 4 contact flags. Accelerations are the differences of the
written velocities over the step that follows (the last row repeats the one
before), so row k pairs the state at its time with the torque held from then on.
"""

import gzip
import io
import pathlib

import numpy as np

from robot_model import JOINTS, LEGS

# Decimals of positions, velocities, accelerations and torques.
FINE = (6, 5, 3, 4)
COARSE = (5, 4, 2, 3)


def column_names():
    """The 71 header names in file order."""
    names = ["Time"]
    for joint in JOINTS:
        names += [f"{joint} {kind}" for kind in ("Position", "Velocity", "Acceleration")]
    for body in ("linear", "angular"):
        for axis in "xyz":
            names += [
                f"Body {body} {kind} {axis}" for kind in ("Position", "Velocity", "Acceleration")
            ]
    names += [f"{joint} Torque" for joint in JOINTS]
    return names + [f"{leg} Foot" for leg in LEGS]


def write_recording(path, time_s, x, dx, torque_nm, feet, digits=FINE):
    """Writes one recording; the same numbers give the same bytes."""
    position_digits, velocity_digits, acceleration_digits, torque_digits = digits
    dx = np.round(dx, velocity_digits)
    step = np.diff(time_s)[:, None]
    ddx = np.diff(dx, axis=0) / step
    ddx = np.vstack([ddx, ddx[-1:]])

    columns = [(time_s, 3)]
    for k in range(x.shape[1]):
        columns += [
            (x[:, k], position_digits),
            (dx[:, k], velocity_digits),
            (ddx[:, k], acceleration_digits),
        ]
    columns += [(torque_nm[:, k], torque_digits) for k in range(torque_nm.shape[1])]
    texts = [[_decimal(value, digits) for value in column] for column, digits in columns]
    texts += [[str(int(flag)) for flag in feet[:, k]] for k in range(feet.shape[1])]

    lines = [";".join(column_names())] + [";".join(row) for row in zip(*texts, strict=True)]
    raw = io.BytesIO()
    with gzip.GzipFile(filename="", fileobj=raw, mode="wb", compresslevel=9, mtime=0) as packed:
        packed.write(("\n".join(lines) + "\n").encode("ascii"))
    path = pathlib.Path(path)
    beside = path.with_name(path.name + ".part")
    beside.write_bytes(raw.getvalue())
    beside.replace(path)


def read_recording(path):
    """Dictionary of column name -> values (rows,), of a file in this format."""
    with gzip.open(path, "rt", encoding="ascii") as file:
        header = file.readline().rstrip("\n").split(";")
        rows = [[float(v.replace(",", ".")) for v in line.split(";")] for line in file]
    if header != column_names():
        raise ValueError(f"{path}: not the 71 columns of a recording")
    return dict(zip(header, np.array(rows).T, strict=True))


def states_of(columns):
    """(x, dx, ddx, torque, feet) arrays, rows first, of `read_recording`'s dictionary."""
    coordinates = [name for name in column_names() if "Position" in name]

    def stack(kind):
        return np.stack([columns[n.replace("Position", kind)] for n in coordinates], axis=1)

    torque = np.stack([columns[f"{joint} Torque"] for joint in JOINTS], axis=1)
    feet = np.stack([columns[f"{leg} Foot"] for leg in LEGS], axis=1) > 0.5
    return stack("Position"), stack("Velocity"), stack("Acceleration"), torque, feet


def _decimal(value, digits):
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text.replace(".", ",")
