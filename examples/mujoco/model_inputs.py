"""Inputs of a jump by the rule of a model: `u` of a reference for its controller.

The model's own generated C is the rule: `NAME_generalised_input`, compiled with `cc` and called
through ctypes. It subtracts friction from the motors' torques; the inertia of motors and legs is
subtracted here, as romc does with recordings: from accelerations averaged over 11
samples of equal contact, by the rule `ground` of a model that of the motors only while a foot is
down, and that of a leg (`NAME_leg_torque`, where the model has it) while its own foot is.
"""

import ctypes
import json
import pathlib
import subprocess
from dataclasses import dataclass

import numpy as np

from romc_controller import emitted

WINDOW = 11


@dataclass(frozen=True)
class ModelInputs:
    """The rule of a model: its name in C, the compiled library, the motors' inertia (kg m^2) and
    whether it is a loss in flight.
    """

    name: str
    library: pathlib.Path
    armature: tuple
    in_flight: bool

    @classmethod
    def compiled(cls, model_path, folder, romc):
        """The rule of a model file; its C is compiled into `folder`."""
        folder.mkdir(parents=True, exist_ok=True)
        header = emitted(model_path, "c", folder, romc, ".h")
        library = folder / f"lib{header.stem}.so"
        compile_c = ["cc", "-O2", "-shared", "-fPIC", str(header.with_suffix(".c")), "-lm"]
        subprocess.run([*compile_c, "-o", str(library)], check=True)
        model = json.loads(pathlib.Path(model_path).read_text(encoding="utf-8"))
        armature = model.get("actuators", {}).get("armature", [0.0] * 12)
        in_flight = model.get("wrench_frame") != "ground"
        return cls(header.stem, library, tuple(armature), in_flight)

    def of(self, jump):
        """(rows, 18) input of a jump with `time_s`, `x`, `dx`, `torque_nm` and `feet`."""
        library = ctypes.CDLL(str(self.library))
        ddx = smoothed_accelerations(jump)
        is_loss = self.in_flight | jump.feet.any(axis=1, keepdims=True)
        tau = jump.torque_nm - np.array(self.armature) * ddx[:, :12] * is_loss
        legs = getattr(library, f"{self.name}_leg_torque", None)
        if legs is not None:
            tau = tau - rows_of(legs, (jump.x, jump.dx, ddx, jump.feet), 12)
        inputs = getattr(library, f"{self.name}_generalised_input")
        return rows_of(inputs, (jump.x, jump.dx, tau, jump.feet), 18)


def rows_of(function, arrays, width):
    """(rows, width) results of a function of C, called with the same row of each array."""
    function.restype = None
    pointer = ctypes.POINTER(ctypes.c_double)
    columns = [np.ascontiguousarray(array, dtype=float) for array in arrays]
    out = np.zeros((len(columns[0]), width))
    for row in range(len(out)):
        arguments = [column[row].ctypes.data_as(pointer) for column in columns]
        function(*arguments, out[row].ctypes.data_as(pointer))
    return out


def smoothed_accelerations(jump):
    """(rows, 18) accelerations, averaged within stretches of equal contact."""
    step_s = jump.time_s[1] - jump.time_s[0]
    ddq = np.vstack([np.diff(jump.dx, axis=0), np.zeros((1, jump.dx.shape[1]))]) / step_s
    ddq[-1] = ddq[-2]
    down = jump.feet.any(axis=1)
    borders = [0, *(np.flatnonzero(np.diff(down)) + 1), len(down)]
    smooth = np.zeros_like(ddq)
    for start, end in zip(borders, borders[1:]):
        for row in range(start, end):
            reach = min(WINDOW // 2, row - start, end - 1 - row)
            smooth[row] = ddq[row - reach : row + reach + 1].mean(axis=0)
    return smooth
