"""Fits PySINDy models, exports and imports them, and compares the accelerations at random points.

    python examples/pysindy/check_export.py --romc target/release/romc

Ends with an error unless the imported model agrees with PySINDy's own prediction to rounding.
"""

import argparse
import json
import math
import pathlib
import shlex
import subprocess
import sys
import tempfile

import numpy as np
import pysindy as ps

from export_pysindy import ExportError, export, term_of

BOUND = 1e-12
LATENT = 2
NAMES = ["z1", "z2", "dz1", "dz2", "u1", "u2"]
FUNCTIONS = {name: getattr(math, name) for name in ("sin", "cos", "tan", "tanh", "exp", "log", "sqrt")}


def samples(seed, count):
    """States (z, dz) and inputs, one row a sample."""
    random = np.random.default_rng(seed)
    return random.normal(size=(count, 2 * LATENT)), random.normal(size=(count, LATENT))


def contact(x, u):
    """A made-up second-order system with inputs."""
    first = 0.36 - 0.91 * x[:, 3] - 0.75 * np.sin(x[:, 2]) + 0.11 * u[:, 0]
    second = -0.16 + 0.3 * x[:, 0] * x[:, 3] - 0.5 * np.cos(2 * x[:, 1]) + 0.14 * u[:, 1]
    return np.stack([first, second], axis=1)


def flight(x, u):
    """The same without ground contact."""
    return np.stack([-0.2 * x[:, 2], -0.981 + 0.05 * x[:, 3]], axis=1)


def fitted(library, system, accelerations_only):
    """A fitted model with the polynomial, Fourier or custom library."""
    x, u = samples(seed=1, count=600)
    ddz = system(x, u)
    derivatives = ddz if accelerations_only else np.hstack([x[:, LATENT:], ddz])
    model = ps.SINDy(feature_library=library, optimizer=ps.STLSQ(threshold=0.01))
    model.fit(x, t=0.002, x_dot=derivatives, u=u)
    return model


def libraries():
    """Libraries by name, each a function so that every model has its own."""
    names = [lambda x: f"tanh({x})", lambda x, y: f"({x} - {y})**2"]
    functions = [lambda x: np.tanh(x), lambda x, y: (x - y) ** 2]
    custom = lambda: ps.CustomLibrary(library_functions=functions, function_names=names)
    return {
        "polynomial": lambda: ps.PolynomialLibrary(degree=3),
        "fourier": lambda: ps.PolynomialLibrary(degree=2) + ps.FourierLibrary(n_frequencies=2),
        "tensored": lambda: ps.PolynomialLibrary(degree=1, include_bias=False) * ps.FourierLibrary(),
        "custom": lambda: ps.PolynomialLibrary(degree=1) + custom(),
    }


def accelerations(document, phase, point):
    """`ddz` of a model file at one point, by Python's own arithmetic."""
    library = document["library"]
    xi = next(entry["xi"] for entry in document["phases"] if entry["name"] == phase)
    scope = dict(FUNCTIONS, **dict(zip(NAMES, point)))
    theta = [eval(term.replace("^", "**"), {"__builtins__": {}}, scope) for term in library]
    return np.array(theta) @ np.array(xi)


def compare(romc, folder, name, ending, accelerations_only):
    """Exports, imports, compares; returns the largest relative difference."""
    models = {
        "contact": fitted(libraries()[name](), contact, accelerations_only),
        "flight": fitted(libraries()["polynomial"](), flight, accelerations_only),
    }
    output = folder / f"{name}{int(accelerations_only)}{ending}"
    command = shlex.split(export(output, models))
    command[0] = str(romc)
    command[-1] = str(output.with_suffix(".json"))
    subprocess.run([*command, "--json"], check=True, stdout=subprocess.DEVNULL)
    document = json.loads(pathlib.Path(command[-1]).read_text())
    x, u = samples(seed=2, count=50)
    worst = 0.0
    for phase, model in models.items():
        expected = model.predict(x, u=u)[:, -LATENT:]
        for row in range(len(x)):
            found = accelerations(document, phase, [*x[row], *u[row]])
            scale = max(1.0, np.abs(expected[row]).max())
            worst = max(worst, np.abs(found - expected[row]).max() / scale)
    return worst


def check_names():
    """Feature names that have no form in romc's grammar are refused, the others translated."""
    for feature, expected in [("1", "1"), ("z1^2 dz1", "z1^2*dz1"), ("sin(2 z1)", "sin(2*z1)"),
                              ("1 cos(1 dz2)", "1*cos(1*dz2)"), ("2.5 (z1 - z2)**2", "2.5*(z1-z2)^2")]:
        found = term_of(feature, NAMES)
        assert found == expected, f"{feature!r}: found {found!r}, expected {expected!r}"
    for feature in ["f0(z1)", "x0", "z1; z2", "heaviside(z1)"]:
        try:
            term_of(feature, NAMES)
        except ExportError:
            continue
        raise AssertionError(f"{feature!r} was accepted")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--romc", type=pathlib.Path, default=pathlib.Path("target/release/romc"),
                        help="the binary to check")
    arguments = parser.parse_args()
    check_names()
    failed = False
    with tempfile.TemporaryDirectory() as folder:
        for name in libraries():
            for ending, accelerations_only in [(".npz", False), (".safetensors", True)]:
                worst = compare(arguments.romc.resolve(), pathlib.Path(folder), name, ending,
                                accelerations_only)
                failed |= not worst <= BOUND
                print(f"{name:12} {ending:13} largest relative difference {worst:.1e}")
    if failed:
        sys.exit(f"error: found differences above {BOUND}")


if __name__ == "__main__":
    main()
