"""Tensors by name to a model."""

from __future__ import annotations

import os
import re
from typing import Any, Dict, List, Mapping, Optional, Sequence, Union

import numpy as np

from romc import _romc
from romc._arrays import Floats, floats
from romc._options import Factors, Phases
from romc.errors import ModelError, warn
from romc.library import Library
from romc.recording import PathLike, Recordings, natives

LibraryLike = Union[Library, str, Sequence[str]]


def imported(
    source: str,
    tensors: Dict[str, Floats],
    library: Optional[LibraryLike],
    parts: Mapping[str, object],
    *,
    robot: Optional[PathLike] = None,
    scaling: Optional[Factors] = None,
    input_scaling: Optional[Factors] = None,
    mean: Any = None,
    std: Any = None,
    order: Optional[str] = None,
    phases: Optional[Phases] = None,
    xi_layout: Optional[str] = None,
    library_order: Optional[str] = None,
    wrench_frame: str = "body",
    actuators: Union[PathLike, Mapping[str, Union[Sequence[float], Mapping[str, float]]], None] = None,
    inputs_from: Optional[Recordings] = None,
    unchecked: bool = False,
    sample_time: Optional[float] = None,
    name: str = "model",
    description: str = "",
) -> "_romc.Model":
    """A model of named tensors by the importer of `romc import`; `Model.from_arrays` describes the options."""
    for key, value in (("mean.state", mean), ("std.state", std)):
        if value is not None:
            tensors[key] = floats(key, value)
    # Equations alone have no robot coordinates to scale, and tensors may have the factors.
    has_map = any(re.search(r"(^|[./])(en|de)coder([._/]|$)", key) for key in tensors)
    has_factors = any(re.search(r"(^|[./])(scaling|std)[._](state|input)$", key) for key in tensors)
    if scaling is None and has_map and not has_factors:
        scaling = 1.0
    if isinstance(library, Library) and library.order is not None:
        if library_order not in (None, library.order):
            found = f"{library_order!r} and Library(order={library.order!r})"
            raise ModelError(f"library_order: found {found}, expected one order")
        library_order = library.order
    shorthand = library.shorthand() if isinstance(library, Library) else library
    if isinstance(shorthand, str) and ";" in shorthand:
        shorthand = [term.strip() for term in shorthand.split(";")]
    terms = None if shorthand is None or isinstance(shorthand, str) else [str(term) for term in shorthand]
    rules = {phase: feet if isinstance(feet, str) else ",".join(feet) for phase, feet in (phases or {}).items()}
    arguments: Dict[str, object] = {
        **dict.fromkeys(("activation", "weights", "latent_dim")),
        "map": [],
        **parts,
        "library": shorthand if terms is None else None,
        "terms": terms,
        "scaling": _factors("scaling", scaling),
        "input_scaling": _factors("input_scaling", input_scaling),
        "phases": [f"{phase}={feet}" for phase, feet in rules.items()],
        "xi_layout": xi_layout,
        "library_order": library_order,
        "robot": None if robot is None else os.fspath(robot),
        "order": order,
        "wrench_frame": wrench_frame,
        "actuators": os.fspath(actuators) if isinstance(actuators, os.PathLike) else actuators,
        "sample_time": sample_time,
        "unchecked": unchecked,
        "name": name,
        "description": description,
    }
    recordings = [] if inputs_from is None else natives(inputs_from)
    native, fault = _romc.import_tensors(source, list(tensors.items()), arguments, recordings)
    if fault is not None:
        warn(fault)
    return native


def _factors(name: str, factors: Optional[Factors]) -> List[float]:
    return [] if factors is None else [float(factor) for factor in np.atleast_1d(floats(name, factors))]
