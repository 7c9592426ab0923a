"""Reduced-order models."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from romc import _romc, _sources
from romc._arrays import Floats, floats, rows
from romc._options import Factors, Phases
from romc.equations import Equations
from romc.errors import ModelError, warn
from romc.library import Library
from romc.plan import Plan
from romc.recording import PathLike, Recording, Recordings, Segment, natives, read
from romc.simulation import Simulation

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from romc._options import ImportOptions

LibraryLike = Union[Library, str, Sequence[str]]


class Model:
    """A checked model: encoder and decoder between the robot's 18 coordinates and d latent ones, and per phase
    accelerations `ddz = Xi^T Theta(z, dz, u)` over a library of candidate terms.

    Make one with `load`, `from_arrays`, `from_torch`, `from_pysindy`, or `romc train` on the command line.
    """

    def __init__(self, native: "_romc.Model", *, exact: bool = False) -> None:
        self._native = native
        # Coefficients whose digits simplification has chosen are printed in full.
        self._exact = exact

    @classmethod
    def load(cls, path: PathLike) -> "Model":
        """Reads a model file. Raises `ModelError` with the tensor, row and column that are wrong."""
        return cls(_romc.Model.load(os.fspath(path)))

    @classmethod
    def from_arrays(
        cls,
        *,
        xi: Union[Mapping[str, Any], Any, None] = None,
        library: Optional[LibraryLike] = None,
        encoder: Any = None,
        decoder: Any = None,
        mask: Optional[Mapping[str, Any]] = None,
        activation: Optional[str] = None,
        weights: Optional[str] = None,
        latent_dim: Optional[int] = None,
        **options: Unpack[ImportOptions],
    ) -> "Model":
        """A model of arrays: NumPy's, JAX's, PyTorch's, lists.

        - `encoder`, `decoder`: `(weights, bias)` with weights `(d, n)` and `(n, d)` as in `z = W x + b` (or their
          transposes, which `weights="row"` says where both fit); a list of such pairs, one per layer, with
          `activation`; or a fitted affine pipeline with `transform` and `inverse_transform`, as scikit-learn has.
        - `xi`: coefficients by phase, `(terms, d)` or `(d, terms)`; `mask` has 0 where training switched one off.
        - `library`: the candidate terms in the order of Xi's rows: names such as `["1", "z1", "sin(dz1)", "u1"]`, or
          the shorthand `Library(degree=1, trigonometric=True, inputs=True, order="paper")`.

        Options, which `from_torch` and `from_pysindy` take too:

        - `robot`: `"go1"`, `"go2"`, `"a1"`, or a `.toml` or `.urdf` file.
        - `scaling`, `input_scaling`: scaled value = factor x SI value, one number or one per coordinate; 1 if left out.
        - `mean`, `std`: `(n,)`, of a trainer that took `(x - mean) / std`.
        - `order`: the order of the 18 coordinates in the arrays, such as `"body,fl,fr,rl,rr"`, if it is not romc's.
        - `phases`: the feet that select each phase, `any`, `none`, `always` or patterns such as `"0011,0001"` (fr
          fl rr rl), the first match wins; `contact` and `flight` are known.
        - `wrench_frame`: axes of the force and moment in the inputs, `"body"` (as published), `"world"` or `"ground"`.
        - `actuators`: friction and inertia of the joints, if training took them from the torques: a mapping of
          `"viscous"` (N m s/rad), `"dry"` (N m) and `"armature"` (kg m^2), 12 numbers each or 3 for a leg, and if known `"legs"`, a mapping of
          the moments of a leg; or a file of `romc identify`.
        - `inputs_from`: recordings that give the mean and covariance of the inputs, which the controller needs, and
          that the model is compared with: one that misses them is refused, with the usual slip that explains it;
          `unchecked=True` warns instead.
        - `library_order`: the order of the terms of a shorthand, as `Library` describes it.
        - `xi_layout`, `sample_time` (s), `name`, `description`.

        Raises `ModelError` with `tensor`, `row` and `column`.
        """
        tensors = _sources.map_tensors("encoder", encoder)
        tensors.update(_sources.map_tensors("decoder", decoder))
        tensors.update(_sources.phase_tensors("xi", xi))
        tensors.update(_sources.phase_tensors("mask", mask))
        parts = {"activation": activation, "weights": weights, "latent_dim": latent_dim}
        return cls._imported("Model.from_arrays", tensors, library, parts, **options)

    @classmethod
    def from_torch(
        cls,
        module: Any,
        decoder: Any = None,
        *,
        library: Optional[LibraryLike] = None,
        xi: Union[Mapping[str, Any], Any, None] = None,
        map: Optional[Mapping[str, str]] = None,
        **options: Unpack[ImportOptions],
    ) -> "Model":
        """A model of a PyTorch module with parts named `encoder` and `decoder`, or of two modules: chains of `Linear`
        with one kind of activation between them.

        Xi by phase is `xi`, or found in the module by name (`xi.contact`, `xi_flight`, ...); `map` names others, as
        `{"xi.contact": "Xi_c"}`. The options are those of `from_arrays`.

        Raises `ModelError` whose `tensor` names the layer or tensor.
        """
        tensors, activation = _sources.torch_parts(module, decoder)
        tensors.update(_sources.phase_tensors("xi", xi))
        parts = {
            "activation": activation,
            "weights": "column",
            "map": [f"{part}={tensor}" for part, tensor in (map or {}).items()],
        }
        return cls._imported("Model.from_torch", tensors, library, parts, **options)

    @classmethod
    def from_pysindy(
        cls,
        models: Union[Mapping[str, Any], Any],
        *,
        encoder: Any = None,
        decoder: Any = None,
        activation: Optional[str] = None,
        weights: Optional[str] = None,
        **options: Unpack[ImportOptions],
    ) -> "Model":
        """A model of fitted PySINDy models by phase, or of a single one that always holds.

        Their states are (z1..zd, dz1..dzd), their controls up to d inputs u, their targets (dz, ddz) or ddz alone.
        Terms and coefficients are theirs, with all digits. `encoder`, `decoder` and the options are those of
        `from_arrays`.
        """
        latent_dim, terms, coefficients = _sources.pysindy_parts(models)
        options["xi_layout"] = "terms-by-latent"
        return cls.from_arrays(
            xi=coefficients,
            library=terms,
            latent_dim=latent_dim,
            encoder=encoder,
            decoder=decoder,
            activation=activation,
            weights=weights,
            **options,
        )

    @classmethod
    def _imported(
        cls,
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
    ) -> "Model":
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
        return cls(native)

    def save(self, path: PathLike, *, force: bool = False) -> None:
        """Writes a model file; replaces a different one only if forced."""
        self._native.save(os.fspath(path), force)

    @property
    def name(self) -> str:
        """Its name, from which those of generated functions are made."""
        return self._native.name

    @property
    def latent_dim(self) -> int:
        """Number of latent coordinates, d."""
        return self._native.latent_dim

    @property
    def latent_words(self) -> List[str]:
        """Quantity and unit of each latent coordinate, such as `"centre of mass upwards, in 10 m"`: the scaled value is 1
        at 10 m. Empty unless a linear encoder maps the coordinates of a known robot."""
        return self._native.latent_words

    @property
    def library(self) -> List[str]:
        """The candidate terms, in the order of Xi's rows."""
        return self._native.library

    @property
    def xi(self) -> Dict[str, Floats]:
        """Coefficients of each phase, `(terms, d)`, in scaled units; read-only views."""
        return {name: xi for name, _, xi in self._native.phases()}

    @property
    def phases(self) -> Dict[str, str]:
        """The feet that select each phase, in the order in which they are tried."""
        return {name: feet for name, feet, _ in self._native.phases()}

    @property
    def digest(self) -> str:
        """SHA-256 of the model file."""
        return self._native.digest

    def to_dict(self) -> Dict[str, Any]:
        """The model file's object."""
        document: Dict[str, Any] = json.loads(self._native.to_text())
        return document

    def encode(self, x: Any) -> Floats:
        """Latent positions `(n, d)` of states `(n, 18)` in SI units; of one state `(18,)`, `(d,)`."""
        return _rowwise(self._native.encode, ("x", x))

    def decode(self, z: Any) -> Floats:
        """States `(n, 18)` in SI units of latent positions `(n, d)`."""
        return _rowwise(self._native.decode, ("z", z))

    def encode_velocity(self, dx: Any, x: Any = None) -> Floats:
        """Latent velocities `(n, d)` of velocities `(n, 18)`; a nonlinear encoder needs the states `x` too."""
        return _rowwise(self._native.encode_velocity, ("x", self._state(x, dx)), ("dx", dx))

    def project_input(self, u: Any, x: Any = None) -> Floats:
        """Latent inputs `(n, d)` of inputs `(n, 18)` (N m, N); a nonlinear encoder needs the states `x` too."""
        return _rowwise(self._native.project_input, ("x", self._state(x, u)), ("u", u))

    def lift_input(self, u_lat: Any, x: Any = None) -> Floats:
        """Inputs `(n, 18)` (N m, N) of latent inputs `(n, d)`; a nonlinear encoder needs the states `x` too."""
        return _rowwise(self._native.lift_input, ("x", self._state(x, u_lat)), ("u_lat", u_lat))

    def acceleration(self, phase: str, z: Any, dz: Any, u_lat: Any) -> Floats:
        """Latent accelerations `ddz` of a phase, `(n, d)`, at points of three arrays `(n, d)`, in scaled units."""
        return _rowwise(
            lambda *points: self._native.acceleration(phase, *points), ("z", z), ("dz", dz), ("u_lat", u_lat)
        )

    def _state(self, x: Any, like: Any) -> Any:
        if x is not None:
            return x
        if not self._native.is_linear:
            raise ModelError("`x`: found none, expected the states at which a nonlinear encoder is taken", tensor="x")
        shape = floats("x", like).shape
        return np.zeros((*shape[:-1], self._native.state_dim or 0))

    def equations(
        self,
        *,
        digits: Optional[int] = None,
        significant: Optional[int] = None,
        form: Optional[str] = None,
        width: Optional[float] = None,
        rename: Optional[Mapping[str, str]] = None,
        siunitx: bool = False,
        units: str = "si",
        as_learned: bool = False,
    ) -> Equations:
        """The latent accelerations of each phase; formulas in a notebook, `.latex()` for a paper.

        `digits` decimals or `significant` digits of coefficients; `form` is `cases` or `align`, `width` the longest
        line in em; `rename` has other names for variables, `{"z1": "x"}`; `units="physical"` takes the scale factors
        out; `as_learned` keeps coefficients times terms as the model has them. As in `romc compile`.
        """
        arguments = _emit_arguments(
            self,
            digits=digits,
            significant=significant,
            form=form,
            width=width,
            rename=rename,
            siunitx=siunitx,
            units=units,
            as_learned=as_learned,
        )
        return Equations(self._native, arguments)

    def compile(
        self,
        targets: Union[str, Sequence[str]] = ("latex", "c", "rust"),
        out_dir: PathLike = ".",
        *,
        force: bool = False,
        precision: str = "f64",
        sincos: str = "inline",
        units: str = "si",
        digits: Optional[int] = None,
        significant: Optional[int] = None,
        form: Optional[str] = None,
        width: Optional[float] = None,
        rename: Optional[Mapping[str, str]] = None,
        siunitx: bool = False,
        as_learned: bool = False,
    ) -> List[Path]:
        """Writes equations and code into a folder; returns the files. Targets and options are those of
        `romc compile`, and so are the bytes: `latex`, `c`, `rust`, `markdown`, `mathml`, `python`, `casadi`,
        `matlab`, `controller`, ...

        `precision` is `f64` or `f32`, `sincos` `inline` or `library`, `units` of coordinates `si`, `scaled` or
        `physical`. Files that romc did not make stay, unless `force`.
        """
        arguments = _emit_arguments(
            self,
            digits=digits,
            significant=significant,
            form=form,
            width=width,
            rename=rename,
            siunitx=siunitx,
            units=units,
            as_learned=as_learned,
            precision=precision,
            sincos=sincos,
        )
        files = _romc.emit(self._native, [targets] if isinstance(targets, str) else list(targets), arguments)
        return [Path(path) for path in _romc.write_files(os.fspath(out_dir), files, force)]

    def simplify(
        self,
        domain: Union[Recordings, Mapping[str, Mapping[str, Tuple[float, float]]]],
        tolerance: Union[float, str] = 0.0,
        *,
        margin: Optional[float] = None,
    ) -> "Simplified":
        """A shorter model, none of whose accelerations is off by more than `tolerance` anywhere in the domain, and
        the certificate.

        `domain`: recordings, whose bounding box in each phase counts, widened by `margin` (0.1 of each range unless
        given); or ranges by phase and variable, `{"contact": {"z1": (-0.2, 0.4), ...}}`, in scaled units.
        `tolerance`: a number in scaled units per s^2, or `"1%"` of each acceleration's root mean square.
        """
        ranges = _ranges(domain) if isinstance(domain, Mapping) else None
        recordings = natives(domain) if not isinstance(domain, Mapping) else []
        text = tolerance if isinstance(tolerance, str) else repr(float(tolerance))
        native, is_changed, certificate, page = _romc.simplify(self._native, text, recordings, ranges, margin)
        return Simplified(Model(native, exact=is_changed), json.loads(certificate), page)

    def simulate(self, recordings: Recordings, *, restart_every: float = 0.1) -> Simulation:
        """Rolls the model out along recordings (or their files) under the recorded inputs: whole segments, and
        restarted from the recorded state every `restart_every` seconds. Equal to `romc simulate`.
        """
        return Simulation(self._native, natives(recordings), restart_every)

    def plan(
        self,
        distance: float,
        apex: float,
        *,
        start: Union[Recording, Segment, PathLike, None] = None,
        force: bool = False,
    ) -> Plan:
        """Plans a jump over `distance` m whose body rises by `apex` m, as `romc plan` does; the model needs landmarks
        and a prior, which `romc train` writes.

        `start`: a recording whose first sample the jump starts from, else the mean start of the training jumps.
        Raises `RomcError` with the reasons where there is no plan to be trusted, unless `force`.
        """
        if isinstance(start, (str, os.PathLike)):
            start = read(start)
        segment = start[0] if isinstance(start, Recording) else start
        native = None if segment is None else segment._native
        return Plan(*_romc.plan(self._native, distance, apex, native, force))

    def walk(
        self, speed: float, *, yaw_rate: float = 0.0, duration: float = 5.0, force: bool = False
    ) -> Recording:
        """Plans a walk of `duration` s at `speed` m/s that turns by `yaw_rate` rad/s, as `romc plan --speed` does; the model
        needs strides, which `romc train --phases trot` writes.

        Raises `RomcError` where speed or yaw rate are far from those of the training, unless `force`.
        """
        return Recording(_romc.walk(self._native, speed, yaw_rate, duration, force))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Model) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def __reduce__(self) -> Tuple[Any, Tuple[str, str, bool]]:
        return _unpickled, (self.name, self._native.to_text(), self._exact)

    def __repr__(self) -> str:
        summary = self._native.summary()
        parts = [f"{self.latent_dim} latent coordinates", f"phases {', '.join(self.phases)}"]
        parts += [f"{key} {summary[key]}" for key in ("encoder", "robot") if key in summary]
        return f"<Model {self.name!r}: {', '.join(parts)}>"

    def _repr_latex_(self) -> str:
        return self.equations()._repr_latex_()


class Simplified(NamedTuple):
    """The result of `Model.simplify`."""

    model: Model
    """The shorter model."""
    certificate: Dict[str, Any]
    """Terms, digits and operations before and after, and for each change its error's bound: the object
    `simplification` of `romc compile --json`."""
    page: str
    """The same as Markdown."""


def _unpickled(name: str, text: str, exact: bool) -> Model:
    return Model(_romc.Model.from_text(name, text), exact=exact)


def _rowwise(function: Any, *arguments: Tuple[str, Any]) -> Floats:
    """A function of rows, also of single ones."""
    arrays = [(name, floats(name, value)) for name, value in arguments]
    if all(array.ndim == 1 for _, array in arrays):
        of_one: Floats = function(*(np.ascontiguousarray(array)[None] for _, array in arrays))[0]
        return of_one
    of_all: Floats = function(*(rows(name, array) for name, array in arrays))
    return of_all


def _factors(name: str, factors: Optional[Factors]) -> List[float]:
    return [] if factors is None else [float(factor) for factor in np.atleast_1d(floats(name, factors))]


def _emit_arguments(model: Model, *, rename: Optional[Mapping[str, str]], **others: Any) -> Dict[str, object]:
    """The options of `romc compile`."""
    arguments: Dict[str, object] = {
        "precision": "f64",
        "sincos": "inline",
        "exact": model._exact,
        "rename": [f"{variable}={name}" for variable, name in (rename or {}).items()],
    }
    return {**arguments, **others}


def _ranges(domain: Mapping[str, Mapping[str, Tuple[float, float]]]) -> str:
    """Ranges as the command line reads them from a file."""
    lines = []
    for phase, variables in domain.items():
        lines.append(f"[{json.dumps(phase)}]")
        for variable, (low, high) in variables.items():
            lines.append(f"{json.dumps(variable)} = [{float(low)!r}, {float(high)!r}]")
    return "\n".join(lines) + "\n"
