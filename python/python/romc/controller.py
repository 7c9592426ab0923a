"""The latent controller."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, Dict, List, Optional, Union

import numpy as np
from numpy.typing import NDArray

from romc import _romc
from romc._arrays import Floats, flags, floats, rows
from romc.errors import RecordingError
from romc.model import Model
from romc.recording import PathLike, Recording, Segment, natives, read


@dataclass(frozen=True)
class Command:
    """What the robot's joints get until the next step."""

    torque: Floats
    """Feed-forward torques, `(12,)`, in N m, within the robot's limits whatever happened."""
    joint_position: Floats
    """Joint angles for the motors' PD, `(12,)`, in rad."""
    joint_velocity: Floats
    """Joint velocities for the motors' PD, `(12,)`, in rad/s."""
    u_lat: Floats
    """Latent input, `(d,)`, scaled."""
    status: str
    """How the step ended: `solved`, `softened`, `contact_early`, ... with a plan, else why there is none."""
    status_code: int
    """The same as in the generated controllers: 0 solved, positive a fallback or changed problem, negative refused
    input."""
    has_plan: bool
    """Whether the command comes from this step's own plan."""
    source: str
    """`plan`, `shifted_plan` or `hold`."""
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

    `summary` has counts, times and agreement of the steps themselves. The arrays have one row per step: `t` (s),
    `torque` and `recorded_torque` `(n, 12)` (N m), `u` `(n, 18)`, `u_lat`, `z`, `z_ref` `(n, d)`, `solve_us`,
    `iterations`, `segment`; `phase` and `status` are lists of words.
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

    def __init__(self, summary: str, arrays: Dict[str, Any]) -> None:
        self.summary = json.loads(summary)
        self.__dict__.update(arrays)

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        return f"<ControlRun of {len(self)} steps>"


class Controller:
    """Latent model-predictive control: a reference, then one command per measurement.

    `horizon` stages of `step` seconds. `lift` makes torques of the latent input: `transpose` (`u = W_e^T u_lat`) or
    `consistent` (torques whose own ground forces come closest). The weights are those of `docs/control.md`; what is
    `None` has the default.

    >>> controller = romc.Controller(model).set_reference(jump)
    >>> controller.step(t, x, dx, feet).torque
    """

    def __init__(
        self,
        model: Model,
        horizon: int = 20,
        step: float = 0.01,
        lift: str = "transpose",
        *,
        input_weight: Optional[float] = None,
        velocity_weight: Optional[float] = None,
        max_iterations: Optional[int] = None,
    ) -> None:
        settings: Dict[str, object] = {
            "horizon": horizon,
            "step": step,
            "lift": lift,
            "input_weight": input_weight,
            "velocity_weight": velocity_weight,
            "max_iterations": max_iterations,
        }
        self._native = _romc.Controller(model._native, settings)

    def set_reference(
        self,
        reference: Union[Recording, Segment, PathLike, None] = None,
        *,
        t: Any = None,
        x: Any = None,
        dx: Any = None,
        feet: Any = None,
        u: Any = None,
        reference_input: str = "recorded",
    ) -> "Controller":
        """Takes a trajectory to follow; returns the controller.

        Either a recording of one segment, a segment or a file: then `reference_input` says whether its torques are
        the input's reference (`recorded`) or none are (`none`). Or arrays with the shapes and units of a segment's;
        `u`, `(n, 18)`, is estimated from the model if not given.

        Raises `RecordingError` with `row` (the sample, from 0) and `column`.
        """
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

    def step(self, t: float, x: Any, dx: Any, feet: Any) -> Command:
        """The command for a measurement: time (s), state `(18,)` and velocity `(18,)` in SI units, feet `(4,)`.

        Never raises for numbers that make no sense: the command is then a safe one, and its status says why.
        """
        step = self._native.step(
            t,
            np.ascontiguousarray(floats("x", x, 1, RecordingError)),
            np.ascontiguousarray(floats("dx", dx, 1, RecordingError)),
            flags("feet", feet, 1),
        )
        return Command(**step)

    def along(self, recording: Union[Recording, PathLike], reference_input: str = "recorded") -> ControlRun:
        """Runs along a recording from a fresh start, as `romc mpc` does: what would have been commanded there."""
        [native] = natives(recording)
        return ControlRun(*self._native.along(native, reference_input))

    def reset(self) -> None:
        """Forgets plan and past measurements, but not the reference."""
        self._native.reset()
