"""Recordings: files or arrays of jumps."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Dict, Iterable, Iterator, List, Union

import numpy as np

from romc import _romc
from romc._arrays import Flags, Floats, flags, floats, rows
from romc.errors import RecordingError

if TYPE_CHECKING:
    from romc.model import Model

PathLike = Union[str, "os.PathLike[str]"]


class Segment:
    """Consecutive samples of a recording; the arrays are read-only views of its memory, one row per sample."""

    def __init__(self, native: "_romc.Segment") -> None:
        self._native = native

    @property
    def t(self) -> Floats:
        """Times, `(n,)`, in s, increasing."""
        return self._native.t

    @property
    def x(self) -> Floats:
        """States, `(n, 18)`: joint angles (rad; fr, fl, rr, rl, each hx, hy, kn), body position (m), roll, pitch,
        yaw (rad)."""
        return self._native.x

    @property
    def dx(self) -> Floats:
        """Velocities of the state, `(n, 18)`, per s; the last three are rates of the angles."""
        return self._native.dx

    @property
    def ddx(self) -> Floats:
        """Accelerations of the state, `(n, 18)`, per s^2."""
        return self._native.ddx

    @property
    def torque(self) -> Floats:
        """Torques of the motors, `(n, 12)`, in N m."""
        return self._native.torque

    @property
    def feet(self) -> Flags:
        """Contact of the feet fr, fl, rr, rl, `(n, 4)`."""
        return self._native.feet

    @property
    def first_row(self) -> int:
        """Row of the file with the first sample; the header is row 1."""
        return self._native.first_row

    def inputs(self, model: Union["Model", str]) -> Floats:
        """The inputs u of a model by its own rule, or of a robot such as `"go1"` as published: `(n, 18)`, torques at
        the joints (N m), force (N) and moment (N m) on the body."""
        if isinstance(model, str):
            return self._native.inputs_of(model)
        return self._native.inputs(model._native)

    def __len__(self) -> int:
        return len(self._native)

    def __repr__(self) -> str:
        return f"<Segment of {len(self)} samples, {self.t[-1] - self.t[0]:.3f} s>"


class Recording:
    """One or several jumps: a sequence of segments.

    A recording of one segment has its arrays too: `recording.x` is `recording[0].x`.
    """

    def __init__(self, native: "_romc.Recording") -> None:
        self._native = native

    @classmethod
    def from_arrays(
        cls,
        t: Any,
        x: Any,
        dx: Any,
        torque: Any,
        feet: Any,
        *,
        ddx: Any = None,
        name: str = "arrays",
    ) -> "Recording":
        """A recording of arrays with the shapes and units of a `Segment`'s; accelerations come from differences of
        the velocities unless given. Checked as a file is: a gap or a jump back in time begins a segment.

        Raises `RecordingError` with `row` (the sample, from 0) and `column`.
        """
        arrays: Dict[str, object] = {
            "t": np.ascontiguousarray(floats("t", t, 1, RecordingError)),
            "x": rows("x", x, RecordingError),
            "dx": rows("dx", dx, RecordingError),
            "ddx": None if ddx is None else rows("ddx", ddx, RecordingError),
            "torque": rows("torque", torque, RecordingError),
            "feet": flags("feet", feet, 2),
        }
        return cls(_romc.from_arrays(name, arrays))

    @property
    def path(self) -> str:
        """The file."""
        return self._native.path

    @property
    def ignored_columns(self) -> List[str]:
        """Columns of the file that were not read."""
        return self._native.ignored_columns

    def save(self, path: PathLike, *, force: bool = False) -> None:
        """Writes the recording as romc's CSV, compressed if the name ends in `.gz`; replaces a file only if forced."""
        self._native.save(os.fspath(path), force)

    def __len__(self) -> int:
        return len(self._native)

    def __getitem__(self, index: int) -> Segment:
        count = len(self)
        if not -count <= index < count:
            raise IndexError(f"segment {index} of {count}")
        return Segment(self._native.segment(index % count))

    def __iter__(self) -> Iterator[Segment]:
        return (self[index] for index in range(len(self)))

    def _only(self) -> Segment:
        if len(self) != 1:
            raise RecordingError(f"{self.path}: found {len(self)} segments, expected one: take recording[0], ...")
        return self[0]

    @property
    def t(self) -> Floats:
        """Times of the only segment, `(n,)`, in s."""
        return self._only().t

    @property
    def x(self) -> Floats:
        """States of the only segment, `(n, 18)`, in rad and m."""
        return self._only().x

    @property
    def dx(self) -> Floats:
        """Velocities of the only segment, `(n, 18)`, per s."""
        return self._only().dx

    @property
    def ddx(self) -> Floats:
        """Accelerations of the only segment, `(n, 18)`, per s^2."""
        return self._only().ddx

    @property
    def torque(self) -> Floats:
        """Torques of the only segment, `(n, 12)`, in N m."""
        return self._only().torque

    @property
    def feet(self) -> Flags:
        """Contact of the feet of the only segment, `(n, 4)`."""
        return self._only().feet

    def inputs(self, model: Union["Model", str]) -> Floats:
        """The inputs of a model or robot in the only segment, `(n, 18)`, in N m and N."""
        return self._only().inputs(model)

    def __repr__(self) -> str:
        return f"<Recording {self.path!r}, {len(self)} segments>"


def read(path: PathLike) -> Recording:
    """Reads a recording, `.csv` or `.csv.gz`.

    Raises `RecordingError` with `file`, `row` (from 1, the header) and `column`.
    """
    return Recording(_romc.read(os.fspath(path)))


Recordings = Union[PathLike, Recording, Iterable[Union[PathLike, Recording]]]


def natives(recordings: Recordings) -> List["_romc.Recording"]:
    """Recordings or their files, one or several."""
    if isinstance(recordings, (str, os.PathLike, Recording)):
        recordings = [recordings]
    given = (entry if isinstance(entry, Recording) else read(entry) for entry in recordings)
    return [recording._native for recording in given]


