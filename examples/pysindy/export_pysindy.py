"""Fitted PySINDy models of latent dynamics to files that `romc import` reads.

A model of d latent coordinates has the state (z1..zd, dz1..dzd) and up to d inputs (u1..ud) as
controls. Fit one PySINDy model per phase, either on all derivatives (dz, ddz) or on the
accelerations ddz alone; the coefficients of the accelerations are exported with all their digits.

From Python:

    from export_pysindy import export
    export("hopper.npz", {"contact": contact_model, "flight": flight_model})

or for models kept with pickle (which runs code on loading: only your own files):

    python export_pysindy.py --model contact=contact.pkl --model flight=flight.pkl --output hopper.npz

Either writes hopper.npz (or .safetensors, by the ending) and hopper.terms.json, the candidate terms
in romc's grammar, and prints the command that imports them.
"""

import argparse
import json
import pathlib
import pickle
import re
import shlex
import sys

import numpy as np

FUNCTIONS = ("sin", "cos", "tan", "tanh", "exp", "log", "sqrt", "abs")
TOKEN = re.compile(
    r"\s*(?P<number>\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)"
    r"|\s*(?P<name>[A-Za-z_]\w*)"
    r"|\s*(?P<sign>\*\*|[-+*/^()])"
)


class ExportError(ValueError):
    """A model that romc cannot represent; the message has the form found and the one expected."""


def term_of(feature, variables):
    """A PySINDy feature name in romc's grammar: `z1 sin(2 dz1)` becomes `z1*sin(2*dz1)`.

    PySINDy writes products as spaces (polynomial, Fourier and tensored libraries); names of custom
    libraries may use the operators + - * / ^ (or **), parentheses and romc's functions.
    """
    tokens = []
    position = 0
    text = feature.strip()
    while position < len(text):
        match = TOKEN.match(text, position)
        if match is None:
            raise ExportError(f"feature {feature!r}: found {text[position]!r}, expected a number, "
                              "a variable, a function or an operator")
        position = match.end()
        token = match.group().strip()
        called = text[position:position + 1] == "("
        if match["name"] and not (token in FUNCTIONS if called else token in variables):
            known = FUNCTIONS if called else variables
            raise ExportError(f"feature {feature!r}: found {token!r}, expected one of "
                              f"{', '.join(known)}; a CustomLibrary needs function_names in "
                              "this grammar")
        is_operand = bool(match["number"] or match["name"]) or token == "("
        if tokens and is_operand and ends_operand(tokens[-1]):
            tokens.append("*")
        tokens.append("^" if token == "**" else token)
    return "".join(tokens)


def ends_operand(token):
    """Whether an operand that follows this token is multiplied by it."""
    return token == ")" or token[0].isdigit() or (token[0].isalpha() and token not in FUNCTIONS)


def accelerations(name, model):
    """Latent dimension, terms and their coefficients (terms x d) of one fitted model."""
    if type(model).__name__ == "DiscreteSINDy":
        raise ExportError(f"phase {name}: found a discrete-time model, expected derivatives")
    inputs = model.n_control_features_
    states = model.n_features_in_ - inputs
    coefficients = np.asarray(model.coefficients(), dtype=np.float64)
    if states % 2 != 0 or states == 0:
        raise ExportError(f"phase {name}: found {states} states, expected z1..zd and dz1..dzd")
    latent = states // 2
    if inputs > latent:
        raise ExportError(f"phase {name}: found {inputs} controls for {latent} latent coordinates, "
                          "expected at most as many controls as coordinates")
    if len(coefficients) not in (latent, states):
        raise ExportError(f"phase {name}: found {len(coefficients)} targets, expected {states} "
                          f"(dz, ddz) or {latent} (ddz)")
    variables = [f"{kind}{index + 1}" for kind, count in (("z", latent), ("dz", latent), ("u", inputs))
                 for index in range(count)]
    features = model.feature_library.get_feature_names(variables)
    terms = [term_of(feature, variables) for feature in features]
    return latent, terms, coefficients[-latent:].T


def union(phases):
    """One list of terms for all phases, and the coefficients of each in that order."""
    parts = {name: accelerations(name, model) for name, model in phases.items()}
    dims = {latent for latent, _, _ in parts.values()}
    if len(dims) != 1:
        raise ExportError(f"found phases of {sorted(dims)} latent coordinates, expected one number")
    latent = dims.pop()
    terms = []
    for _, of_phase, _ in parts.values():
        terms.extend(term for term in of_phase if term not in terms)
    rows = {term: row for row, term in enumerate(terms)}
    coefficients = {}
    for name, (_, of_phase, xi) in parts.items():
        ordered = np.zeros((len(terms), latent))
        for term, row in zip(of_phase, xi):
            # Two libraries of a ConcatLibrary may both have a term.
            ordered[rows[term]] += row
        coefficients[name] = ordered
    return latent, terms, coefficients


def export(path, phases, encoder=None, decoder=None):
    """Writes models by phase; `encoder` and `decoder` are (weights, bias) with z = W x + b, if any.

    Returns the command line that imports the files.
    """
    path = pathlib.Path(path)
    latent, terms, coefficients = union(phases)
    arrays = {f"xi.{name}": xi for name, xi in coefficients.items()}
    for part, pair in (("encoder", encoder), ("decoder", decoder)):
        if pair is not None:
            weights, bias = pair
            arrays[f"{part}.weight"] = np.asarray(weights, dtype=np.float64)
            arrays[f"{part}.bias"] = np.asarray(bias, dtype=np.float64)
    if path.suffix == ".npz":
        np.savez(path, **arrays)
    elif path.suffix == ".safetensors":
        from safetensors.numpy import save_file
        save_file({name: np.ascontiguousarray(array) for name, array in arrays.items()}, path)
    else:
        raise ExportError(f"{path}: expected a name that ends in .npz or .safetensors")
    terms_path = path.with_suffix(".terms.json")
    terms_path.write_text(json.dumps({"library": terms}, indent=1) + "\n")
    command = ["romc", "import", str(path), "--library", str(terms_path),
               "--latent-dim", str(latent), "--xi-layout", "terms-by-latent"]
    feet = {"contact": "any", "flight": "none"}
    for name in phases:
        command += ["--phase", f"{name}={feet.get(name, 'FEET')}"]
    if encoder is not None or decoder is not None:
        command += ["--weights", "column", "--scaling", "FACTOR"]
    return shlex.join([*command, "--output", f"{path.stem}.json"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--model", action="append", required=True, metavar="PHASE=FILE.pkl",
                        help="a fitted model kept with pickle; once a phase")
    parser.add_argument("--output", required=True, metavar="FILE.npz",
                        help="the file to write, .npz or .safetensors")
    arguments = parser.parse_args()
    phases = {}
    for text in arguments.model:
        name, separator, file = text.partition("=")
        if not separator:
            parser.error(f"--model: found {text!r}, expected PHASE=FILE.pkl")
        with open(file, "rb") as stored:
            phases[name] = pickle.load(stored)
    try:
        print(export(arguments.output, phases))
    except ExportError as error:
        sys.exit(f"error: {error}")


if __name__ == "__main__":
    main()
