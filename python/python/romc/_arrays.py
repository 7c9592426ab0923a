"""Numbers of any kind as arrays of NumPy."""

from __future__ import annotations

from typing import Any, Optional, Tuple, Type

import numpy as np
from numpy.typing import NDArray

from romc.errors import ModelError, RecordingError, RomcError

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


def floats(name: str, value: Any, ndim: Optional[int] = None, error: Type[RomcError] = ModelError) -> Floats:
    """An array of doubles in one piece of memory, without a copy where `value` is one.

    Takes NumPy arrays, lists, PyTorch tensors (on any device, with gradients) and, by the array protocol, JAX arrays
    and everything else that converts.
    """
    if hasattr(value, "detach"):
        value = value.detach().cpu().double()
    try:
        array = np.asarray(value)
        # Numbers of other kinds, such as bfloat16, convert; complex ones would lose a part.
        if array.dtype.kind in "cOSUmM":
            raise TypeError(f"numbers of type {array.dtype}")
        array = np.asarray(array, dtype=np.float64)
    except (TypeError, ValueError) as reason:
        found = f"{type(value).__name__} ({reason})"
        raise _refused(error, name, f"found {found}, expected an array of numbers") from reason
    if ndim is not None and array.ndim != ndim:
        found = f"found {array.ndim} dimensions {array.shape}, expected {ndim}"
        raise _refused(error, name, found)
    if not (array.flags.c_contiguous or array.flags.f_contiguous):
        array = np.ascontiguousarray(array)
    return array


def rows(name: str, value: Any, error: Type[RomcError] = ModelError) -> Floats:
    """Rows of doubles, each after the other in memory."""
    return np.ascontiguousarray(floats(name, value, 2, error))


def flags(name: str, value: Any, ndim: int) -> Flags:
    """Booleans; numbers must be 0 or 1."""
    array = np.asarray(value)
    if array.dtype != np.bool_:
        numbers = floats(name, value, ndim, RecordingError)
        bad = np.argwhere((numbers != 0.0) & (numbers != 1.0))
        if bad.size:
            row = int(bad[0][0]) if ndim == 2 else None
            found = f"`{name}`: found {numbers[tuple(bad[0])]} at {bad[0].tolist()}, expected contact 0 or 1"
            raise RecordingError(found, row=row, column=name)
        array = numbers != 0.0
    if array.ndim != ndim:
        raise _refused(RecordingError, name, f"found {array.ndim} dimensions {array.shape}, expected {ndim}")
    return np.ascontiguousarray(array)


def _refused(error: Type[RomcError], name: str, message: str) -> RomcError:
    place = {"column": name} if error is RecordingError else {"tensor": name}
    return error(f"`{name}`: {message}", **place)  # type: ignore[arg-type]


def rowwise(function: Any, *arguments: Tuple[str, Any]) -> Floats:
    """A function of rows, also of single ones."""
    arrays = [(name, floats(name, value)) for name, value in arguments]
    if all(array.ndim == 1 for _, array in arrays):
        of_one: Floats = function(*(np.ascontiguousarray(array)[None] for _, array in arrays))[0]
        return of_one
    of_all: Floats = function(*(rows(name, array) for name, array in arrays))
    return of_all
