"""Benchmark models: coefficients of the standard library from fixed seeds."""

import itertools
import json
import random
from pathlib import Path

PAPER_CONTACT = {
    "1": [0.36, -0.16], "dz1": [-0.16, -0.23], "dz2": [-0.91, -0.75],
    "sin(dz1)": [-0.75, 0.0], "sin(dz2)": [0.0, -0.96], "u1": [0.11, 0.0], "u2": [-0.05, 0.14],
}
PAPER_FLIGHT = {
    "1": [0.29, 0.0], "dz1": [-1.22, 0.42], "sin(dz1)": [-1.0, 0.52], "u1": [51.05, 0.0],
}


def terms(d, degree):
    """The standard library: constant, monomials in z and dz by degree, sines, cosines, inputs."""
    variables = [f"z{i + 1}" for i in range(d)] + [f"dz{i + 1}" for i in range(d)]
    names = ["1"]
    for power in range(1, degree + 1):
        for factors in itertools.combinations_with_replacement(variables, power):
            names.append("*".join(factors))
    for function in ("sin", "cos"):
        names += [f"{function}({v})" for v in variables]
    return names + [f"u{i + 1}" for i in range(d)]


def scattered(d, degree, share, seed):
    """Normal coefficients, each present with probability `share`."""
    source = random.Random(seed)
    return {
        "d": d,
        "poly_order": degree,
        "xi": [
            [source.gauss(0, 1) if source.random() < share else 0.0 for _ in range(d)]
            for _ in terms(d, degree)
        ],
    }


def paper(rows):
    return {"d": 2, "poly_order": 1, "xi": [rows.get(name, [0.0, 0.0]) for name in terms(2, 1)]}


def read(folder):
    """Name and model of each JSON file of a folder, or of the built-in models."""
    if folder:
        return {path.stem: json.loads(path.read_text()) for path in sorted(Path(folder).glob("*.json"))}
    return {
        "contact": paper(PAPER_CONTACT),
        "flight": paper(PAPER_FLIGHT),
        "sparse4": scattered(4, 1, 0.35, 4),
        "dense18": scattered(18, 1, 1.0, 18),
        "quadratic4": scattered(4, 2, 0.3, 42),
        "cubic8": scattered(8, 3, 0.1, 83),
        "quadratic8": scattered(8, 2, 0.3, 82),
        "cubic4": scattered(4, 3, 0.3, 43),
    }


def romc_model(name, model):
    """The model file of a benchmark model."""
    return {
        "schema": "romc-model/1",
        "name": name,
        "latent_dim": model["d"],
        "library": terms(model["d"], model["poly_order"]),
        "phases": [{"name": "phase", "feet": "any", "xi": model["xi"]}],
    }
