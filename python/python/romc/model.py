"""Reduced-order models."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from romc import _romc, _sources
from romc._arrays import Floats, floats, rowwise
from romc._command import Arguments
from romc._import import LibraryLike, imported
from romc._options import emit_arguments, ranges
from romc.equations import Equations
from romc.errors import ModelError
from romc.plan import Plan
from romc.recording import PathLike, Recording, Recordings, Segment, listed, natives, read
from romc.simulation import Score, Simulation

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from romc._options import ImportOptions

MODELS: Tuple[str, ...] = tuple(_romc.shipped_models())
"""Names of the models that are part of the package, for `Model.load`."""


class Model:
    """A checked model: encoder and decoder between the robot's 18 coordinates and d latent ones, and per phase
    accelerations `ddz = Xi^T Theta(z, dz, u)` over a library of candidate terms.

    Make one with `romc.train`, `load`, `from_arrays`, `from_torch` or `from_pysindy`. `print` shows its equations in m,
    rad and N.
    """

    training: Optional[Dict[str, Any]]
    """The object of `romc train --json` for a model of `romc.train`: `report` with metrics by set, `test`, `notes`;
    `None` for others."""

    def __init__(
        self, native: "_romc.Model", *, exact: bool = False, training: Optional[Dict[str, Any]] = None
    ) -> None:
        self._native = native
        # Coefficients whose digits simplification has chosen are printed in full.
        self._exact = exact
        self.training = training

    @classmethod
    def load(cls, path: PathLike) -> "Model":
        """Reads a model file, or a model of the package by its name in `romc.MODELS`, such as `"go1-d4"`.

        Raises `ModelError` with the tensor, row and column that are wrong.
        """
        name = os.fspath(path)
        if name == "-" or os.path.exists(name):
            return cls(_romc.Model.load(name))
        shipped = _romc.shipped_model(name)
        if shipped is None:
            expected = f'a file such as "my-model.json", or one of {", ".join(MODELS)}'
            raise ModelError(f"{name}: no such file and no model of the package; expected {expected}", file=name)
        return cls(shipped)

    @classmethod
    def from_dict(cls, document: Mapping[str, Any], name: str = "document") -> "Model":
        """The model of a model file's object, as `to_dict` gives it; `name` stands for the file in errors."""
        return cls(_romc.Model.from_text(name, json.dumps(document)))

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
          transposes, with `weights="row"` where both fit); a list of such pairs, one per layer, with
          `activation`; or a fitted affine pipeline with `transform` and `inverse_transform`, as scikit-learn has.
        - `xi`: coefficients by phase, `(terms, d)` or `(d, terms)`; `mask` has 0 where training switched one off.
        - `library`: the candidate terms in the order of Xi's rows: names such as `["1", "z1", "sin(dz1)", "u1"]`, or
          the shorthand `Library(degree=1, trigonometric=True, inputs=True, order="paper")`.

        Options, also of `from_torch` and `from_pysindy`:

        - `robot`: `"go1"`, `"go2"`, `"a1"`, or a `.toml` or `.urdf` file.
        - `scaling`, `input_scaling`: scaled value = factor x SI value, one number or one per coordinate; 1 if left out.
        - `mean`, `std`: `(n,)`, of a trainer that took `(x - mean) / std`.
        - `order`: the order of the 18 coordinates in the arrays, such as `"body,fl,fr,rl,rr"`, if it is not romc's.
        - `phases`: the feet that select each phase, `any`, `none`, `always` or patterns such as `"0011,0001"` (fr
          fl rr rl), the first match wins; `contact` and `flight` are known.
        - `wrench_frame`: axes of the force and moment in the inputs, `"body"` (as published), `"world"` or `"ground"`.
        - `actuators`: friction and inertia of the joints, if training subtracted them from the torques: a mapping of
          `"viscous"` (N m s/rad), `"dry"` (N m) and `"armature"` (kg m^2), 12 numbers each or 3 for a leg, and if known
          `"legs"`, a mapping of the moments of a leg; or a file of `romc identify`.
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
        return cls(imported("Model.from_arrays", tensors, library, parts, **options))

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
        return cls(imported("Model.from_torch", tensors, library, parts, **options))

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
        """Quantity and unit of each latent coordinate, such as `"centre of mass upwards, in 10 m"`: the scaled value is
        1 at 10 m. Empty without a linear encoder of the coordinates of a known robot."""
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
        return rowwise(self._native.encode, ("x", x))

    def decode(self, z: Any) -> Floats:
        """States `(n, 18)` in SI units of latent positions `(n, d)`."""
        return rowwise(self._native.decode, ("z", z))

    def encode_velocity(self, dx: Any, x: Any = None) -> Floats:
        """Latent velocities `(n, d)` of velocities `(n, 18)`; a nonlinear encoder also needs the states `x`."""
        return rowwise(self._native.encode_velocity, ("x", self._state(x, dx)), ("dx", dx))

    def project_input(self, u: Any, x: Any = None) -> Floats:
        """Latent inputs `(n, d)` of inputs `(n, 18)` (N m, N); a nonlinear encoder also needs the states `x`."""
        return rowwise(self._native.project_input, ("x", self._state(x, u)), ("u", u))

    def lift_input(self, u_lat: Any, x: Any = None) -> Floats:
        """Inputs `(n, 18)` (N m, N) of latent inputs `(n, d)`; a nonlinear encoder also needs the states `x`."""
        return rowwise(self._native.lift_input, ("x", self._state(x, u_lat)), ("u_lat", u_lat))

    def acceleration(self, phase: str, z: Any, dz: Any, u_lat: Any) -> Floats:
        """Latent accelerations `ddz` of a phase, `(n, d)`, at points of three arrays `(n, d)`, in scaled units."""
        return rowwise(
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
        units: Optional[str] = None,
        as_learned: bool = False,
    ) -> Equations:
        """The latent accelerations of each phase; formulas in a notebook, text by `print`, `.latex()` for a paper.

        `digits` decimals or `significant` digits of coefficients; `form` is `cases` or `align`, `width` the longest
        line in em; `rename` has other names for variables, `{"z1": "x"}`; `units` is `"physical"` (m, rad, N: the
        default of a model that has such units) or `"si"` (the latent coordinates as the model scales them);
        `as_learned` keeps coefficients times terms as the model has them. As in `romc compile`.
        """
        arguments = emit_arguments(
            self._exact,
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
        `physical`. Files that romc did not make are replaced only with `force`.
        """
        arguments = emit_arguments(
            self._exact,
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
        """A shorter model, whose accelerations have errors of at most `tolerance` everywhere in the domain, and the
        certificate.

        `domain`: recordings, whose bounding box in each phase counts, widened by `margin` (of each range,
        0.1 by default); or ranges by phase and variable, `{"contact": {"z1": (-0.2, 0.4), ...}}`, in scaled units.
        `tolerance`: a number in scaled units per s^2, or `"1%"` of each acceleration's root mean square.
        """
        bounds = ranges(domain) if isinstance(domain, Mapping) else None
        recordings = natives(domain, self._native) if not isinstance(domain, Mapping) else []
        text = tolerance if isinstance(tolerance, str) else repr(float(tolerance))
        native, is_changed, certificate, page = _romc.simplify(self._native, text, recordings, bounds, margin)
        return Simplified(Model(native, exact=is_changed), json.loads(certificate), page)

    def predict(self, recording: Union[Recording, PathLike], horizon_s: Optional[float] = 0.1) -> Floats:
        """Predicted states `(n, 18)` of all samples of a recording, in rad and m, under the recorded inputs.

        Predictions start again from the recorded state every `horizon_s` seconds, or only at the first sample of each
        segment if it is `None`. Rows are in the order of `recording.x`, several segments one below the other; NaN where
        a prediction diverged.

        >>> model.predict(jump, horizon_s=0.1)[:, 14] - jump.x[:, 14]      # error of the body's height, m
        """
        if not isinstance(recording, (str, os.PathLike, Recording)):
            found = f"found {type(recording).__name__}, expected one recording or file"
            raise ModelError(f"predict: {found}; for several, [model.predict(one) for one in recordings]")
        [native] = natives(recording, self._native)
        return _romc.predict(self._native, native, horizon_s)

    def score(self, recordings: Recordings, horizon_s: float = 0.1) -> Score:
        """The verdict on the model along recordings (or their files), which training should not have used.

        A dict: uses of the model that it is fit for, those that it failed, and the rows that decide, each with its
        value, baseline, threshold and whether it passed. `horizon_s` is the time of the short predictions, in s.

        >>> model.score(jumps)["fit_for"]
        ['0.1 s', 'whole motion', 'torques', 'control']
        """
        return Score(*_romc.score(self._native, natives(recordings, self._native), horizon_s))

    def report(
        self,
        recordings: Recordings,
        path: PathLike,
        *,
        restart_every: Optional[float] = None,
        tolerance: Union[float, str, None] = None,
        study: Optional[PathLike] = None,
        plan: Union[Recording, PathLike, None] = None,
        figures: Optional[PathLike] = None,
        columns: Optional[PathLike] = None,
        clock: Optional[str] = None,
        force: bool = False,
    ) -> Path:
        """Writes the page of `romc report` on the model along recordings (or their files): equations, errors,
        baselines, torques of the controller. Returns its path, which ends in `.html`.

        `restart_every` is the time of the short predictions in s, `tolerance` that of the simplification which the
        page lists (`"1%"` by default), `study` a folder of `romc.study`, `plan` the plan that the first jump follows,
        `figures` a folder for each figure as SVG, PDF and CSV. `force` replaces an existing page.
        """
        arguments = Arguments("report").file(f"{self.name}.json").recordings(recordings)
        arguments.recordings([] if plan is None else listed(plan), "plan")
        arguments.options(restart_every=restart_every, tolerance=tolerance, study=study, figures=figures)
        arguments.options(columns=columns, clock=clock, output=path, force=force).run(self._native)
        return Path(path)

    def simulate(self, recordings: Recordings, *, restart_every: float = 0.1) -> Simulation:
        """Rolls the model out along recordings (or their files) under the recorded inputs: whole segments, and
        restarted from the recorded state every `restart_every` seconds. Equal to `romc simulate`.
        """
        return Simulation(self._native, natives(recordings, self._native), restart_every)

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
        Raises `RomcError` with the reasons where there is no trusted plan; `force` returns it nevertheless.
        """
        if isinstance(start, (str, os.PathLike)):
            start = read(start)
        segment = start[0] if isinstance(start, Recording) else start
        native = None if segment is None else segment._native
        return Plan(*_romc.plan(self._native, distance, apex, native, force))

    def walk(
        self, speed: float, *, yaw_rate: float = 0.0, duration: float = 5.0, force: bool = False
    ) -> Recording:
        """Plans a walk of `duration` s at `speed` m/s that turns by `yaw_rate` rad/s, as `romc plan --speed` does; the
        model needs strides, which `romc train --phases trot` writes.

        Raises `RomcError` where speed or yaw rate are far from those of the training; `force` returns it
        nevertheless.
        """
        return Recording(_romc.walk(self._native, speed, yaw_rate, duration, force))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Model) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def __reduce__(self) -> Tuple[Any, ...]:
        return _unpickled, (self.name, self._native.to_text(), self._exact, self.training)

    def __repr__(self) -> str:
        summary = self._native.summary()
        parts = [f"{self.latent_dim} latent coordinates", f"phases {', '.join(self.phases)}"]
        parts += [f"{key} {summary[key]}" for key in ("encoder", "robot") if key in summary]
        return f"<Model {self.name!r}: {', '.join(parts)}>"

    def __str__(self) -> str:
        robot = self._native.summary().get("robot")
        of_robot = "" if robot is None else f" of the robot {robot}"
        coordinates = "1 latent coordinate" if self.latent_dim == 1 else f"{self.latent_dim} latent coordinates"
        phases = ("phase " if len(self.phases) == 1 else "phases ") + ", ".join(self.phases)
        return f"{self.name}: {coordinates}{of_robot}, {phases}\n\n{self.equations()}"

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


def _unpickled(name: str, text: str, exact: bool, training: Optional[Dict[str, Any]]) -> Model:
    return Model(_romc.Model.from_text(name, text), exact=exact, training=training)
