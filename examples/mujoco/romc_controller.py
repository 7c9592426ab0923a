"""A generated controller (`romc compile MODEL --emit controller`) through its C interface."""

import ctypes
import subprocess

import numpy as np

DOUBLES = ctypes.POINTER(ctypes.c_double)
BYTES = ctypes.POINTER(ctypes.c_uint8)


class RomcController:
    """One controller; `name` is the model's name as an identifier, such as go1_d6."""

    def __init__(self, library, name, latent_dim):
        class Command(ctypes.Structure):
            """NAME_command of the generated header."""

            _fields_ = [
                ("torque", ctypes.c_double * 12),
                ("joint_position", ctypes.c_double * 12),
                ("joint_velocity", ctypes.c_double * 12),
                ("u_lat", ctypes.c_double * latent_dim),
                ("status", ctypes.c_int32),
                ("iterations", ctypes.c_int32),
                ("solve_us", ctypes.c_double),
            ]

        functions = ctypes.CDLL(str(library))

        def function(verb, result, *arguments):
            found = getattr(functions, f"{name}_controller_{verb}")
            found.restype, found.argtypes = result, arguments
            return found

        handle = ctypes.c_void_p
        self._set_reference = function(
            "set_reference", ctypes.c_int, handle, ctypes.c_size_t, *[DOUBLES] * 4, BYTES
        )
        self._step = function(
            "step",
            ctypes.c_int,
            handle,
            ctypes.c_double,
            DOUBLES,
            DOUBLES,
            BYTES,
            ctypes.POINTER(Command),
        )
        self._status_text = function("status_text", ctypes.c_char_p, ctypes.c_int32)
        self._free = function("free", None, handle)
        self._command = Command()
        self._handle = function("new", handle, ctypes.c_void_p)(None)
        if not self._handle:
            raise RuntimeError(f"{library}: no controller could be made")

    def set_reference(self, time_s, x, dx, u, feet):
        """Samples to follow: (rows,), (rows, 18) twice, (rows, 18) or None, (rows, 4) flags."""
        time_s, x, dx = doubles(time_s), doubles(x), doubles(dx)
        u = None if u is None else doubles(u)
        feet = np.ascontiguousarray(feet, dtype=np.uint8)
        result = self._set_reference(
            self._handle,
            len(time_s),
            pointer(time_s),
            pointer(x),
            pointer(dx),
            None if u is None else pointer(u),
            feet.ctypes.data_as(BYTES),
        )
        if result != 0:
            raise RuntimeError(f"reference refused: {self.status_text(result)}")

    def step(self, time_s, x, dx, feet):
        """The command for a measurement; the same structure is filled again at every call."""
        x, dx = doubles(x), doubles(dx)
        feet = np.ascontiguousarray(feet, dtype=np.uint8)
        self._step(
            self._handle,
            time_s,
            pointer(x),
            pointer(dx),
            feet.ctypes.data_as(BYTES),
            ctypes.byref(self._command),
        )
        return self._command

    def status_text(self, status):
        """What a status means."""
        return self._status_text(status).decode()

    def close(self):
        """Frees the controller; it must not be used afterwards."""
        if self._handle:
            self._free(self._handle)
            self._handle = None


def doubles(values):
    return np.ascontiguousarray(values, dtype=np.float64)


def pointer(values):
    return values.ctypes.data_as(DOUBLES)


def build_controller(romc, model, name, folder):
    """Generates the controller of a model into a folder and compiles it with cargo.

    Returns the shared library and the model's name as the library's identifiers have it.
    """
    identifier = name.replace("-", "_")
    command = [romc, "compile", model, "--emit", "controller", "--out-dir", folder, "--force"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    crate = folder / f"{identifier}-controller"
    subprocess.run(["cargo", "build", "--release", "--quiet"], cwd=crate, check=True)
    return crate / f"target/release/lib{identifier}_controller.so", identifier
