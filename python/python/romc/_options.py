"""Options of functions that have many."""

from __future__ import annotations

import json
from typing import Any, Dict, Mapping, Optional, Sequence, Tuple, TypedDict, Union

from romc._arrays import Floats
from romc.recording import PathLike, Recordings

Factors = Union[float, Sequence[float], Floats]
Phases = Mapping[str, Union[str, Sequence[str]]]


class ImportOptions(TypedDict, total=False):
    """The options of `Model.from_arrays`, `from_torch` and `from_pysindy`; the first describes them."""

    robot: PathLike
    scaling: Factors
    input_scaling: Factors
    mean: Any
    std: Any
    order: str
    phases: Phases
    xi_layout: str
    library_order: str
    wrench_frame: str
    actuators: Union[PathLike, Mapping[str, Union[Sequence[float], Mapping[str, float]]]]
    inputs_from: Recordings
    unchecked: bool
    sample_time: float
    name: str
    description: str


class TrainOptions(TypedDict, total=False):
    """Options of `romc train` by their names there, which `docs/reference/training-settings.md` documents."""

    split: Sequence[int]
    config: PathLike
    method: str
    robot: PathLike
    paper: bool
    seed: int
    seeds: int
    epochs: int
    encoder_layers: Union[str, Sequence[int]]
    decoder_layers: Union[str, Sequence[int]]
    activation: str
    lift_weight: float
    body_weight: float
    bptt_weight: float
    bptt_window: int
    bptt_stride: int
    bptt_decay: float
    bptt_integrator: str
    slack: float
    refinements: int
    growth: float
    degree: int
    trigonometric: bool
    terms: Union[str, Sequence[str]]
    actuators: PathLike
    wrench_frame: str
    phases: Union[str, Phases]
    leave_out_implausible: bool
    accelerations: str
    smooth: Union[str, Sequence[int]]
    smooth_rows: str
    moving_average: int
    mask_std: float
    mask_input_share: float
    coordinates: str
    body: Union[str, Sequence[str]]
    body_equations: str
    mirror_images: str
    leave_out: Union[str, Sequence[str]]
    no_rotation: bool
    state_scaling: float
    torque_scaling: float
    force_scaling: float
    moment_scaling: float
    columns: PathLike
    clock: str


class StudyOptions(TypedDict, total=False):
    """Options of `romc study` by their names there; `romc study --help` has each."""

    method: str
    paper: bool
    robot: PathLike
    config: PathLike
    lambda_: float
    shard: str
    columns: PathLike
    clock: str


def emit_arguments(exact: bool, *, rename: Optional[Mapping[str, str]], **others: Any) -> Dict[str, object]:
    """The options of `romc compile`."""
    arguments: Dict[str, object] = {
        "precision": "f64",
        "sincos": "inline",
        "exact": exact,
        "rename": [f"{variable}={name}" for variable, name in (rename or {}).items()],
    }
    return {**arguments, **others}


def ranges(domain: Mapping[str, Mapping[str, Tuple[float, float]]]) -> str:
    """Ranges as the command line reads them from a file."""
    lines = []
    for phase, variables in domain.items():
        lines.append(f"[{json.dumps(phase)}]")
        for variable, (low, high) in variables.items():
            lines.append(f"{json.dumps(variable)} = [{float(low)!r}, {float(high)!r}]")
    return "\n".join(lines) + "\n"
