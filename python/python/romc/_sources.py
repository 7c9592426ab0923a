"""Parts of a model from objects of other libraries, by their methods: nothing of theirs is imported."""

from __future__ import annotations

from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from romc._arrays import Floats, floats, rows
from romc.errors import ModelError

Tensors = Dict[str, Floats]

# Layers of PyTorch by class: romc's activation, and the settings that it stands for.
_ACTIVATIONS: Dict[str, Tuple[str, Dict[str, object]]] = {
    "ELU": ("elu", {"alpha": 1.0}),
    "GELU": ("gelu", {"approximate": "none"}),
    "ReLU": ("relu", {}),
    "Sigmoid": ("sigmoid", {}),
    "SiLU": ("silu", {}),
    "Softplus": ("softplus", {"beta": 1, "threshold": 20}),
    "Tanh": ("tanh", {}),
}
# Layers that do nothing once training has ended.
_PASSIVE = ("Dropout", "Identity")

LayerPair = Tuple[Any, Any]


def map_tensors(part: str, source: Any) -> Tensors:
    """The tensors of an encoder or decoder: a pair (weights, bias), a list of pairs, one per layer, or a fitted
    pipeline with `transform` and `inverse_transform` (scikit-learn), which has to be affine."""
    if source is None:
        return {}
    method = "transform" if part == "encoder" else "inverse_transform"
    if hasattr(source, method):
        return _layer(part, affine(part, source))
    pairs = [source] if _is_pair(source) else list(source)
    if len(pairs) == 1:
        return _layer(part, pairs[0])
    tensors: Tensors = {}
    for index, pair in enumerate(pairs):
        tensors.update(_layer(f"{part}.{index}", pair))
    return tensors


def _is_pair(source: Any) -> bool:
    """Whether a source is (weights, bias) rather than a list of such pairs."""
    if len(source) != 2:
        return False
    bias = source[1]
    if bias is None or hasattr(bias, "shape"):
        return bias is None or len(bias.shape) <= 1
    return all(np.ndim(entry) == 0 for entry in bias)


def _layer(name: str, pair: LayerPair) -> Tensors:
    parts = () if hasattr(pair, "shape") else tuple(pair)
    if len(parts) != 2:
        found = f"{len(parts)} parts" if parts else "an array"
        raise ModelError(f"`{name}`: found {found}, expected (weights, bias)", tensor=name)
    weights, bias = parts
    tensors = {f"{name}.weight": floats(f"{name}.weight", weights, 2)}
    if bias is not None:
        tensors[f"{name}.bias"] = np.ascontiguousarray(floats(f"{name}.bias", bias))
    return tensors


def affine(part: str, pipeline: Any) -> LayerPair:
    """Weights and bias of a fitted pipeline, from its values at the origin and the unit vectors.

    Raises `ModelError` if random points show that it is not affine.
    """
    if part == "encoder":
        apply, width = pipeline.transform, int(pipeline.n_features_in_)
    else:
        code = rows("encoder", pipeline.transform(np.zeros((1, int(pipeline.n_features_in_)))))
        apply, width = pipeline.inverse_transform, code.shape[1]
    bias = rows(part, apply(np.zeros((1, width))))[0]
    weights = (rows(part, apply(np.eye(width))) - bias).T
    points = np.random.default_rng(0).normal(size=(20, width))
    expected = rows(part, apply(points))
    scale = max(1.0, float(np.abs(expected).max()))
    off = float(np.abs(points @ weights.T + bias - expected).max()) / scale
    if not off <= 1e-9:
        found = f"found a nonlinear {type(pipeline).__name__} (error {off:.1e} of the affine map)"
        expected_text = "an affine one, or layers as pairs (weights, bias) with activation="
        raise ModelError(f"`{part}`: {found}, expected {expected_text}", tensor=part)
    return weights, bias


def phase_tensors(prefix: str, source: Union[Mapping[str, Any], Any, None]) -> Tensors:
    """One tensor per phase under its name, such as `xi.contact`; a tensor alone belongs to the phase `always`."""
    if source is None:
        return {}
    phases = dict(source) if isinstance(source, Mapping) or hasattr(source, "items") else {"always": source}
    return {f"{prefix}.{name}": floats(f"{prefix}.{name}", value) for name, value in phases.items()}


def torch_parts(module: Any, decoder: Any) -> Tuple[Tensors, Optional[str]]:
    """The tensors of a PyTorch module with parts `encoder` and `decoder`, or of two modules, and the activation
    between their layers. Tensors of other parts keep their names in the state dictionary."""
    if decoder is not None:
        parts, others = {"encoder": module, "decoder": decoder}, {}
    else:
        parts = {name: _submodule(module, name) for name in ("encoder", "decoder")}
        inside = {id(tensor) for part in parts.values() for tensor in _storage(part)}
        state = module.state_dict(keep_vars=True)
        others = {name: value for name, value in state.items() if id(value) not in inside}
    tensors: Tensors = {name: floats(name, value) for name, value in others.items()}
    activations: Dict[str, str] = {}
    for name, part in parts.items():
        layers, activation = _torch_layers(name, part)
        tensors.update(layers)
        if activation is not None:
            activations[name] = activation
    if len(set(activations.values())) > 1:
        found = ", ".join(f"{activation} in the {name}" for name, activation in activations.items())
        raise ModelError(f"`encoder`, `decoder`: found {found}, expected one activation", tensor="decoder")
    return tensors, next(iter(activations.values()), None)


def _submodule(module: Any, name: str) -> Any:
    """The part of a module with this name, at any depth; the least deep one."""
    found = [(path, part) for path, part in module.named_modules() if path.split(".")[-1] == name]
    if not found:
        children = ", ".join(path for path, _ in module.named_children()) or "none"
        message = f"`{name}`: found a {type(module).__name__} with parts {children}, expected one named {name}"
        raise ModelError(f"{message}, or Model.from_torch(encoder, decoder, ...)", tensor=name)
    return min(found, key=lambda entry: entry[0].count("."))[1]


def _storage(part: Any) -> Iterator[Any]:
    yield from part.state_dict(keep_vars=True).values()


def _leaves(prefix: str, part: Any) -> Iterator[Tuple[str, Any]]:
    children = list(part.named_children())
    if not children:
        yield prefix, part
    for name, child in children:
        yield from _leaves(f"{prefix}.{name}", child)


def _torch_layers(part: str, module: Any) -> Tuple[Tensors, Optional[str]]:
    """Layers of a chain in their order, numbered as such, and the activation between them."""
    layers: List[LayerPair] = []
    names: List[str] = []
    between: List[Tuple[str, str]] = []
    pending: Optional[Tuple[str, str]] = None
    for name, leaf in _leaves(part, module):
        kind = type(leaf).__name__
        if kind in _PASSIVE:
            continue
        if kind == "Linear":
            if layers:
                if pending is None:
                    raise _refused(name, "two linear layers in a row", "an activation between them")
                between.append(pending)
            layers.append((leaf.weight, leaf.bias))
            names.append(name)
            pending = None
        elif kind in _ACTIVATIONS and layers and pending is None:
            pending = (name, _activation(name, leaf))
        else:
            known = ", ".join(["Linear", *sorted(_ACTIVATIONS)])
            raise _refused(name, f"a layer {kind}", f"a chain of {known}, each activation behind a Linear")
    if not layers:
        raise _refused(part, f"no Linear in a {type(module).__name__}", "at least one")
    if pending is not None:
        raise _refused(pending[0], f"{pending[1]} behind the last Linear", "a linear last layer")
    if len({activation for _, activation in between}) > 1:
        found = ", ".join(f"{activation} ({name})" for name, activation in between)
        raise _refused(part, found, "one activation between all layers")
    activation = between[0][1] if between else None
    if len(layers) == 1:
        return _layer(part, layers[0]), activation
    tensors: Tensors = {}
    for number, layer in zip(_numbers(names), layers):
        tensors.update(_layer(f"{part}.{number}", layer))
    return tensors, activation


def _numbers(names: List[str]) -> List[int]:
    """The modules' own numbers, as in `encoder.2`, where they rise; else 0, 1, ..."""
    ends = [name.rpartition(".")[2] for name in names]
    numbers = [int(end) for end in ends if end.isdigit()]
    is_rising = all(first < second for first, second in zip(numbers, numbers[1:]))
    return numbers if len(numbers) == len(names) and is_rising else list(range(len(names)))


def _activation(name: str, leaf: Any) -> str:
    activation, settings = _ACTIVATIONS[type(leaf).__name__]
    for setting, expected in settings.items():
        found = getattr(leaf, setting, expected)
        if found != expected:
            raise _refused(name, f"{type(leaf).__name__}({setting}={found!r})", f"{setting}={expected!r}")
    return activation


def _refused(name: str, found: str, expected: str) -> ModelError:
    return ModelError(f"`{name}`: found {found}, expected {expected}", tensor=name)


def pysindy_parts(models: Any) -> Tuple[int, List[str], Dict[str, Floats]]:
    """Latent dimension, terms and coefficients by phase of fitted PySINDy models.

    Terms are PySINDy's own names over z1.., dz1.., u1..; terms that a phase does not have are zero there.
    """
    phases = dict(models) if isinstance(models, Mapping) else {"always": models}
    parts = {name: _pysindy_part(name, model) for name, model in phases.items()}
    dims = sorted({latent for latent, _, _ in parts.values()})
    if len(dims) != 1:
        raise ModelError(f"phases: found {dims} latent coordinates, expected one number")
    terms = list(dict.fromkeys(term for _, of_phase, _ in parts.values() for term in of_phase))
    rows_of = {term: row for row, term in enumerate(terms)}
    coefficients = {}
    for name, (latent, of_phase, xi) in parts.items():
        ordered = np.zeros((len(terms), latent))
        # Two libraries of a ConcatLibrary may both have a term.
        np.add.at(ordered, [rows_of[term] for term in of_phase], xi)
        coefficients[name] = ordered
    return dims[0], terms, coefficients


def _pysindy_part(phase: str, model: Any) -> Tuple[int, Sequence[str], Floats]:
    place = f"xi.{phase}"
    if type(model).__name__ == "DiscreteSINDy":
        raise _refused(place, "a discrete-time model", "one of derivatives")
    inputs = int(model.n_control_features_)
    states = int(model.n_features_in_) - inputs
    latent = states // 2
    if states == 0 or states % 2 != 0:
        raise _refused(place, f"{states} states", "z1..zd and dz1..dzd")
    if inputs > latent:
        raise _refused(place, f"{inputs} controls", f"at most {latent}, as many as latent coordinates")
    coefficients = floats(place, model.coefficients(), 2)
    if len(coefficients) not in (latent, states):
        raise _refused(place, f"{len(coefficients)} targets", f"{states} (dz, ddz) or {latent} (ddz)")
    kinds = [("z", latent), ("dz", latent), ("u", inputs)]
    variables = [f"{kind}{index}" for kind, count in kinds for index in range(1, count + 1)]
    terms = model.feature_library.get_feature_names(variables)
    return latent, terms, coefficients[-latent:].T
