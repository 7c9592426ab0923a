"""The controller of romc through the C interface of `library.rs`."""

import ctypes

import numpy as np

DOUBLES = ctypes.POINTER(ctypes.c_double)
BYTES = ctypes.POINTER(ctypes.c_uint8)


class Command(ctypes.Structure):
    """`RomcCommand` of the library."""

    _fields_ = [
        ("torque", ctypes.c_double * 12),
        ("joint_position", ctypes.c_double * 12),
        ("joint_velocity", ctypes.c_double * 12),
        ("status", ctypes.c_int32),
        ("iterations", ctypes.c_int32),
        ("solve_us", ctypes.c_double),
    ]


class RomcController:
    """One controller of a model file."""

    def __init__(self, library, model):
        functions = ctypes.CDLL(str(library))

        def function(verb, result, *arguments):
            found = getattr(functions, f"romc_controller_{verb}")
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
        self._free = function("free", None, handle)
        self._command = Command()
        self._handle = function("new", handle, ctypes.c_char_p)(str(model).encode())
        if not self._handle:
            raise RuntimeError(f"{model}: no controller could be made")

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
            raise RuntimeError("the controller refused its reference")

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

    def close(self):
        """Frees the controller; it must not be used afterwards."""
        if self._handle:
            self._free(self._handle)
            self._handle = None


def doubles(values):
    return np.ascontiguousarray(values, dtype=np.float64)


def pointer(values):
    return values.ctypes.data_as(DOUBLES)
