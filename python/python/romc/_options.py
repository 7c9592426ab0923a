"""Arguments that several constructors of models take."""

from __future__ import annotations

from typing import Any, Mapping, Sequence, TypedDict, Union

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
