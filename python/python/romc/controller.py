"""The latent controller."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, Dict, List, Optional, Union

import numpy as np
from numpy.typing import NDArray

from romc import _romc
from romc._arrays import Floats, flags, floats, rows
from romc.errors import RecordingError, RomcError
from romc.model import Model
from romc.recording import PathLike, Recording, Segment, natives, read


STATUSES: Dict[str, str] = dict(_romc.statuses())
"""Words of all statuses of a step, with their meanings."""


@dataclass(frozen=True)
class Command:
    """The command of the robot's joints until the next step."""

    torque: Floats
    """Feed-forward torques, `(12,)`, in N m, within the robot's limits whatever happened."""
    joint_position: Floats
    """Joint angles for the motors' PD, `(12,)`, in rad."""
    joint_velocity: Floats
    """Joint velocities for the motors' PD, `(12,)`, in rad/s."""
    stiffness: float
    """Gain of that PD on joint angles, in N m/rad."""
    damping: float
    """Gain of that PD on joint velocities, in N m s/rad."""
    u_lat: Floats
    """Latent input, `(d,)`, scaled."""
    status: str
    """How the step ended: `solved`, `softened`, `contact_early`, ... with a plan, else why there is none. `STATUSES`
    has them all."""
    status_code: int
    """The same as in the generated controllers: 0 solved, positive a fallback or changed problem, negative refused
    input."""
    has_plan: bool
    """Whether the command comes from this step's own plan."""
    source: str
    """`plan`, `shifted_plan`, `hold` or `damping`."""
    phase: Optional[str]
    """Phase of the plan's first stage."""
    iterations: int
    """Iterations of the solver."""
    solve_us: float
    """Wall time of the step, in microseconds."""
    slack: float
    """Largest violation of a joint limit in the plan, in half ranges of the joint."""


class ControlRun:
    """A controller's steps along a recording, which does not feel the commands.

    `summary` is the recording's entry of `runs` in `romc mpc --json`: counts, times and agreement of the steps,
    figures that depend on the dynamics and their `baseline`. It also has `verdict` and `remarks` of that command,
    and as `failures` its list `failed`. `str` is the text that the command prints, with its lines `FAILED`. The
    arrays have one row per step: `t` (s), `torque` and `recorded_torque` `(n, 12)` (N m), `u` `(n, 18)`, `u_lat`,
    `z`, `z_ref` `(n, d)`, `solve_us`, `iterations`, `segment`; `phase` and `status` are lists of words.
    """

    summary: Dict[str, Any]
    segment: NDArray[np.int64]
    t: Floats
    phase: List[Optional[str]]
    status: List[str]
    iterations: NDArray[np.int64]
    solve_us: Floats
    torque: Floats
    recorded_torque: Floats
    u: Floats
    u_lat: Floats
    z: Floats
    z_ref: Floats

    def __init__(self, judged: str, text: str, arrays: Dict[str, Any]) -> None:
        results = json.loads(judged)
        [run] = results["runs"]
        kept = {"verdict": results["verdict"], "remarks": results["remarks"], "failures": results["failed"]}
        self.summary = {**run, **kept}
        self._text = text
        self.__dict__.update(arrays)

    def __len__(self) -> int:
        return len(self.t)

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return f"<ControlRun of {len(self)} steps>"


class Controller:
    """Latent model-predictive control: a reference, then one command per measurement.

    `horizon` stages of `step` seconds. `lift` makes torques of the latent input: `transpose` (`u = W_e^T u_lat`) or
    `consistent` (torques whose own ground forces come closest). Others of the controller's settings
    (`docs/reference/controller-settings.md`) are keywords under the names in `settings`: a number, or the word of
    `lift`, `solver`, `linearisation`, `after_end`. `float("inf")` switches a bound off, 0 a count and a limit that is 0
    by default; `None` is the default.

    >>> controller = romc.Controller(model).set_reference(jump)
    >>> controller.step(t, x, dx, feet).torque
    """

    def __init__(
        self,
        model: Model,
        horizon: Optional[int] = None,
        step: Optional[float] = None,
        lift: Union[str, int, None] = None,
        **settings: Union[float, str, None],
    ) -> None:
        if step is not None and "step_s" in settings:
            raise RomcError("step: found step and step_s, expected one of them")
        given = {"horizon": horizon, "step_s": step, "lift": lift, **settings}
        self._native = _romc.Controller(model._native, [of for of in given.items() if of[1] is not None])

    @property
    def settings(self) -> Dict[str, Union[float, str]]:
        """All settings by name, as arguments of `Controller(model, **settings)`; `step_s` is `step`."""
        return self._native.settings

    def set_reference(
        self,
        reference: Union[Recording, Segment, PathLike, None] = None,
        *,
        t: Any = None,
        x: Any = None,
        dx: Any = None,
        feet: Any = None,
        u: Any = None,
        torque: Any = None,
        reference_input: str = "recorded",
    ) -> "Controller":
        """Takes a trajectory to follow; returns the controller.

        Either a recording of one segment, a segment or a file: then its torques are the reference of the input
        (`reference_input="recorded"`) or not (`"none"`). Or arrays with the shapes and units of a segment's;
        their input is `u`, `(n, 18)`, or that of the motors' `torque`, `(n, 12)`, by the model's input rule, as of a
        recording; it is estimated from the model if neither is given.

        Raises `RecordingError` with `row` (the sample, from 0) and `column`.
        """
        if torque is not None:
            if u is not None:
                raise RecordingError("`torque`: found `torque` and `u`, expected one of them", column="torque")
            reference = Recording.from_arrays(t, x, dx, torque, feet)
        if reference is not None:
            if isinstance(reference, Segment):
                segment = reference
            else:
                segment = (reference if isinstance(reference, Recording) else read(reference))._only()
            self._native.follow(segment._native, reference_input)
            return self
        self._native.set_reference(
            np.ascontiguousarray(floats("t", t, 1, RecordingError)),
            rows("x", x, RecordingError),
            rows("dx", dx, RecordingError),
            flags("feet", feet, 2),
            None if u is None else rows("u", u, RecordingError),
        )
        return self

    def prepare(self, t: float) -> None:
        """Prepares the step at a time (s), while nothing waits for a command: the step is then faster."""
        self._native.prepare(t)

    def step(self, t: float, x: Any, dx: Any, feet: Any) -> Command:
        """The command for a measurement: time (s), state `(18,)` and velocity `(18,)` in SI units, feet `(4,)`.

        Implausible numbers are no error: the command is then a safe one, and its status has the reason.
        """
        step = self._native.step(
            t,
            np.ascontiguousarray(floats("x", x, 1, RecordingError)),
            np.ascontiguousarray(floats("dx", dx, 1, RecordingError)),
            flags("feet", feet, 1),
        )
        return Command(**step)

    def along(self, recording: Union[Recording, PathLike], reference_input: str = "recorded") -> ControlRun:
        """Runs along a recording from a fresh start, as `romc mpc` does: the commands there, the
        baselines and the verdict."""
        [native] = natives(recording)
        return ControlRun(*self._native.along(native, reference_input))

    def reset(self) -> None:
        """Forgets plan, past measurements and the fault that ended the motion, but not the reference."""
        self._native.reset()
