"""Recordings: files or arrays of jumps."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Dict, Iterable, Iterator, List, Mapping, Optional, Union

import numpy as np

from romc import _romc
from romc._arrays import Flags, Floats, flags, floats, rows
from romc.errors import RecordingError, warn

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

    def inputs(self, model: Union["Model", PathLike], wrench_frame: str = "body") -> Floats:
        """The inputs u, `(n, 18)`: torques at the joints (N m), force (N) and moment (N m) on the body.

        Of a model by its own rule; or of a robot, `"go1"` or a `.toml` or `.urdf` file, without losses in its joints,
        with force and moment along the axes of the body, as published, or of the world.
        """
        if isinstance(model, (str, os.PathLike)):
            return self._native.inputs_of(os.fspath(model), wrench_frame)
        return self._native.inputs(model._native)

    def __len__(self) -> int:
        return len(self._native)

    def __repr__(self) -> str:
        return f"<Segment of {len(self)} samples, {self.t[-1] - self.t[0]:.3f} s>"


class Recording:
    """One or several jumps: a sequence of segments.

    A recording of one segment also has its arrays: `recording.x` is `recording[0].x`.
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
        """A recording of arrays with the shapes and units of a `Segment`'s; accelerations are `ddx`, or
        differences of the velocities. Checked as a file is: a gap or a jump back in time begins a segment.

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
            raise RecordingError(f"{self.path}: found {len(self)} segments, expected one: use recording[0], ...")
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

    def inputs(self, model: Union["Model", PathLike], wrench_frame: str = "body") -> Floats:
        """The inputs of a model or robot in the only segment, `(n, 18)`, in N m and N."""
        return self._only().inputs(model, wrench_frame)

    def __repr__(self) -> str:
        segments = "1 segment" if len(self) == 1 else f"{len(self)} segments"
        return f"<Recording {self.path!r}, {segments}>"


Columns = Union[PathLike, Mapping[str, Any]]


def read(
    path: PathLike, *, columns: Optional[Columns] = None, clock: str = "repaired", robot: Optional[PathLike] = None
) -> Recording:
    """Reads a recording: `.csv`, `.csv.gz`, `.mcap`, or another program's log by a map of its columns.

    - `columns`: the map (`docs/reference/column-maps.md`), a TOML file, or its tables as a dictionary,
      `{"time": {"column": "stamp", "unit": "ms"}, ...}`; with it `path` may be a folder of files.
    - `clock`: as in the commands that compute, times and angular rates that disagree with the motion are mended
      (`repaired`), with a `RomcWarning`, or kept (`recorded`).

    - `robot`: as in the commands, a known robot mends places of the body that are late, and has names of joints in
      `.mcap` files.

    Raises `RecordingError` with `file`, `row` (from 1, the header) and `column`.
    """
    [recording] = _read([path], columns, clock, None if robot is None else os.fspath(robot))
    return recording


def guess_columns(path: PathLike, robot: PathLike = "go1") -> str:
    """A first map of the columns of an unknown log, TOML with the reason of each line, as `romc inspect --guess`
    writes it; a `RomcWarning` has the reason if the log cannot be read by it yet."""
    text, refused = _romc.guess(os.fspath(path), os.fspath(robot))
    if refused is not None:
        warn(f"{os.fspath(path)}: read by the guessed map: {refused}")
    return text


def _read(
    paths: Iterable[PathLike], columns: Optional[Columns], clock: str, robot: Union[str, "_romc.Model", None]
) -> List[Recording]:
    if isinstance(columns, Mapping):
        given: Union[str, Path, None] = "\n".join(f"{json.dumps(key)} = {_toml(of)}" for key, of in columns.items())
    else:
        given = None if columns is None else Path(columns)
    natives_read, notes = _romc.read([os.fspath(path) for path in paths], given, clock, robot)
    for note in notes:
        warn(note)
    return [Recording(native) for native in natives_read]


def _toml(value: Any) -> str:
    """A value of a map as TOML, whose words, numbers and lists are JSON's."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(key)} = {_toml(entry)}" for key, entry in value.items()) + "}"
    return json.dumps(value, ensure_ascii=False)


Recordings = Union[PathLike, Recording, Iterable[Union[PathLike, Recording]]]


def listed(recordings: Recordings) -> List[Union[PathLike, Recording]]:
    """Recordings or their files, one or several, as a list."""
    if isinstance(recordings, (str, os.PathLike, Recording)):
        return [recordings]
    entries = list(recordings)
    for entry in entries:
        if not isinstance(entry, (str, os.PathLike, Recording)):
            found = f"found {type(entry).__name__}, expected paths or recordings"
            remedy = "romc.read(path), or romc.Recording.from_arrays(t, x, dx, torque, feet)"
            raise RecordingError(f"recordings: {found}: {remedy}")
    return entries


def some(recordings: Recordings) -> List[Union[PathLike, Recording]]:
    """The same, at least one."""
    entries = listed(recordings)
    if not entries:
        raise RecordingError("recordings: found none, expected at least one file or `Recording`: romc.read(path)")
    return entries


def natives(
    recordings: Recordings,
    robot: Union[str, "_romc.Model", None] = None,
    *,
    columns: Optional[Columns] = None,
    clock: str = "repaired",
) -> List["_romc.Recording"]:
    """Recordings or their files, one or several; files are read as by `read`, for a robot by its name or a model's."""
    entries = some(recordings)
    from_files = iter(_read([entry for entry in entries if not isinstance(entry, Recording)], columns, clock, robot))
    return [(entry if isinstance(entry, Recording) else next(from_files))._native for entry in entries]


def recordings(name: str = "go1") -> List[Recording]:
    """Recordings that are part of the package: `"go1"` are three jumps of a simulated Go1, about 1.3 s each at 500 Hz,
    which no shipped model was trained on."""
    if name != "go1":
        raise RecordingError(f'recordings: found {name!r}, expected "go1"; romc.read(path) reads a file')
    return [Recording(native) for native in _romc.shipped_recordings()]
