"""Inspection of recordings and models, and identification of a robot from recordings."""

from __future__ import annotations

import json
import os
from typing import Any, Dict, List, Optional, Union

import numpy as np

from romc import _romc
from romc._arrays import Floats
from romc._command import Answer, Arguments
from romc.errors import RomcError
from romc.model import Model
from romc.recording import Columns, PathLike, Recording, Recordings, natives


class Inspection:
    """The findings of `romc inspect` in a recording or a model; `print` shows the text of the command.

    `summary` is its object of `romc inspect --json`.
    """

    summary: Dict[str, Any]

    def __init__(self, answer: Answer) -> None:
        [self.summary] = answer.summary["files"]
        self._text = answer.text

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.summary['file']!r}>"


class RecordingInspection(Inspection):
    """A recording: its ranges, and whether it can be of this robot."""

    @property
    def metrics(self) -> Dict[str, Any]:
        """Plausibility metrics that are compared with the bounds of `docs/reference/recordings.md`: `foot_slip_m` and
        `relative_foot_slip_m` (root mean squares of the places of feet on the ground), `other_reading_m` (the same with
        other signs or legs), `fall_m_s2` (vertical acceleration in flight), `weight_share` (of the weight, carried by
        the torques), `hip_share` by leg, `acceleration_offset_m_s2`; `None` where the recording has too few samples."""
        metrics: Dict[str, Any] = self.summary["figures"]
        return metrics

    @property
    def mismatches(self) -> List[str]:
        """Contradictions to the robot's physics, in words: exchanged legs, other units, a fallen robot, ..."""
        return list(self.summary["mismatches"])

    @property
    def implausible(self) -> List[Dict[str, Any]]:
        """Runs of implausible samples: `what`, `samples`, `segment`, `first_row`, `worst_row`, `column`, `value` and
        the `bound` that it breaks."""
        return list(self.summary["implausible"])

    @property
    def is_plausible(self) -> bool:
        """Whether there is neither a mismatch nor an implausible sample."""
        return not self.mismatches and not self.implausible

    @property
    def segments(self) -> List[Dict[str, Any]]:
        """`samples`, `duration_s`, `mean_step_s`, `first_row` and `phases` of each segment."""
        return list(self.summary["segments"])

    @property
    def ranges(self) -> Dict[str, Dict[str, Any]]:
        """Least and largest `position` (rad, m), `velocity` (per s) and `torque_nm` (N m) by coordinate."""
        return {entry["coordinate"]: entry for entry in self.summary["ranges"]}


class ModelInspection(Inspection):
    """A model: its size, its coordinates, and whether its equations obey known physics."""

    @property
    def phases(self) -> Dict[str, Dict[str, Any]]:
        """`feet`, `active_terms` and number of `coefficients` by phase."""
        return {phase["name"]: phase for phase in self.summary["phases"]}

    @property
    def invariance(self) -> Optional[Dict[str, Any]]:
        """Metrics of known physics: gravity, mass, invariance to shifts and reflection; `None` without a robot."""
        metrics: Optional[Dict[str, Any]] = self.summary["invariance"]
        return metrics

    @property
    def provenance(self) -> Dict[str, Any]:
        """Where the model comes from: command, recordings with digests, report of the training."""
        provenance: Dict[str, Any] = self.summary["provenance"]
        return provenance


def inspect(
    subject: Union[Recording, Model, PathLike],
    *,
    robot: Optional[PathLike] = None,
    columns: Optional[PathLike] = None,
    clock: Optional[str] = None,
) -> Union[RecordingInspection, ModelInspection]:
    """Describes a recording or a model with its implausible parts, as `romc inspect` does.

    `subject` is a `Recording`, a `Model`, or a file of one. `robot` is the robot whose limits and geometry a recording
    is compared with, `"go1"` by default. The clock of a file stays as recorded, except with `clock="repaired"`.

    >>> romc.inspect("jump.csv.gz").metrics["foot_slip_m"]
    """
    arguments = Arguments("inspect").options(robot=robot, columns=columns, clock=clock)
    if isinstance(subject, Model):
        answer = arguments.file(f"{subject.name}.json").run(subject._native)
    else:
        answer = arguments.recordings(subject).run()
    [found] = answer.summary["files"]
    return ModelInspection(answer) if found["kind"] == "model" else RecordingInspection(answer)


class Identification:
    """Gravity, mass and the joints' friction and rotor inertia, found in recordings; `print` shows the text of
    `romc identify`.

    `Model.from_arrays(actuators=found.actuators)` uses them, as does `romc.train(actuators="file.toml")` after
    `found.save("file.toml")`.
    """

    def __init__(self, found: str, toml: str, text: str) -> None:
        self.summary: Dict[str, Any] = json.loads(found)
        self._toml = toml
        self._text = text

    @property
    def mass(self) -> float:
        """Mass of the whole robot, in kg."""
        return float(self.summary["mass_kg"])

    @property
    def gravity(self) -> float:
        """In m/s^2, upwards in contact and flight alike."""
        return float(self.summary["gravity_m_s2"])

    @property
    def delay(self) -> float:
        """Time from a recorded torque to its effect on the motion, in s."""
        return float(self.summary["delay_s"])

    @property
    def viscous_friction(self) -> Floats:
        """Of each joint, `(12,)`, in N m s/rad."""
        return np.array(self.summary["actuators"]["viscous"])

    @property
    def dry_friction(self) -> Floats:
        """Of each joint, `(12,)`, in N m."""
        return np.array(self.summary["actuators"]["dry"])

    @property
    def armature(self) -> Floats:
        """Rotor inertia at each joint, `(12,)`, in kg m^2."""
        return np.array(self.summary["actuators"]["armature"])

    @property
    def actuators(self) -> Dict[str, Any]:
        """Friction and rotor inertia of the joints with the moments of a leg, for `Model.from_arrays`."""
        return {**self.summary["actuators"], "legs": self.summary["legs"]}

    @property
    def standard_error(self) -> Dict[str, Any]:
        """Standard errors: `mass_kg`, `gravity_m_s2`, `delay_s`, and by kind of joint (`hx`, `hy`, `kn`)
        `viscous_nm_s_rad`, `dry_nm`, `armature_kg_m2`; `legs` has those of the moments of a leg."""
        errors: Dict[str, Any] = self.summary["standard_error"]
        return errors

    @property
    def notes(self) -> List[str]:
        """Reasons to doubt the values."""
        return list(self.summary["notes"])

    def to_toml(self) -> str:
        """The file that `romc identify --output` writes."""
        return self._toml

    def save(self, path: PathLike, *, force: bool = False) -> None:
        """Writes `to_toml` to a file; replaces an existing one only if forced."""
        try:
            with open(path, "w" if force else "x", encoding="utf-8") as file:
                file.write(self._toml)
        except FileExistsError:
            raise RomcError(f"{os.fspath(path)}: already exists; pass force=True to replace it") from None

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return f"<Identification of {self.summary['robot']!r}: mass {self.mass:.2f} kg>"


def identify(
    recordings: Recordings,
    robot: PathLike = "go1",
    *,
    columns: Optional[Columns] = None,
    clock: str = "recorded",
) -> Identification:
    """Finds gravity, mass and the joints' friction and rotor inertia in recordings of one robot, as `romc identify`.

    `recordings` are files or `Recording` objects of jumps: flight shows gravity and the legs' inertia, moving legs
    their friction. `robot` is `"go1"`, `"go2"`, `"a1"`, or a `.toml` or `.urdf` file, whose geometry and limits count.

    >>> found = romc.identify("jump.csv.gz", robot="go1")
    >>> found.mass, found.standard_error["mass_kg"]                  # kg

    Raises `RecordingError` where the recordings do not determine them, or are not of one robot.
    """
    name = os.fspath(robot)
    return Identification(*_romc.identify(natives(recordings, name, columns=columns, clock=clock), name))
