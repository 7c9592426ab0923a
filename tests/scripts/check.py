"""Compares generated modules with results of the interpreter.

    check.py numpy|casadi CASES.json

CASES.json holds a list of {file, model, function, is_step, is_smooth, names, inputs, outputs}, inputs and outputs as the rows of
each array at each point; the flat_ and _lens fields are the same for check.m. Results may differ by 1e-11 of one plus the largest magnitude of the expected vector: sines are the library's.
"""

import importlib.util
import json
import pathlib
import sys

import numpy as np

TOLERANCE = 1e-11


def module(path):
    path = pathlib.Path(path)
    spec = importlib.util.spec_from_file_location(path.stem, path)
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


def as_tuple(results):
    return results if isinstance(results, (tuple, list)) else (results,)


def compare(case, found, expected):
    scale = 1.0 + np.max(np.abs(expected), initial=0.0)
    difference = np.max(np.abs(found - expected), initial=0.0)
    assert found.shape == expected.shape, f"{case}: {found.shape} {expected.shape}"
    assert difference <= TOLERANCE * scale, f"{case}: off by {difference}"


def check_numpy(case, functions):
    function = getattr(functions, case["function"])
    points = len(case["inputs"])
    expected = [np.array(rows) for rows in zip(*case["outputs"])]
    for point, inputs in enumerate(case["inputs"]):
        arguments = [np.array(rows) if name != "h" else rows[0] for name, rows in zip(case["names"], inputs)]
        before = [np.copy(argument) for argument in arguments]
        for k, result in enumerate(as_tuple(function(*arguments))):
            if k < len(expected):
                compare(case["function"], result, expected[k][point])
            else:
                assert result.shape == (0,)
        assert all(np.array_equal(a, b) for a, b in zip(arguments, before)), "an argument was changed"
    # All points at once, one per column.
    if not case["is_step"]:
        stacked = [np.array(rows).T for rows in zip(*case["inputs"])]
        for k, result in enumerate(as_tuple(function(*stacked))):
            if k < len(expected):
                compare(case["function"], result, expected[k].T.reshape(-1, points))
    if case["function"].endswith("_jacobian"):
        phase = case["function"].removesuffix("_dynamics_jacobian")
        stored = np.arange(1.0, 1.0 + getattr(functions, f"{phase.upper()}_JACOBIAN_NNZ"))
        matrix = getattr(functions, f"{phase}_jacobian_matrix")(stored)
        assert matrix.shape == (functions.LATENT_DIM, 3 * functions.LATENT_DIM)
        assert np.array_equal(matrix[matrix != 0.0], stored)


def check_casadi(case, functions):
    import casadi

    function = getattr(functions, case["function"])
    assert function.name_in() == case["names"], function.name_in()
    for inputs, outputs in zip(case["inputs"], case["outputs"]):
        results = as_tuple(function(*inputs))
        for k, result in enumerate(results):
            found = np.array(casadi.DM(result).full())
            if case["function"].endswith("_jacobian") and k == 1:
                phase = case["function"].removesuffix("_dynamics_jacobian").upper()
                rows = getattr(functions, f"{phase}_JACOBIAN_ROWS")
                cols = getattr(functions, f"{phase}_JACOBIAN_COLS")
                found = found[list(rows), list(cols)]
                assert casadi.DM(result).nnz() == len(rows)
                expected = np.array(outputs[k]) if k < len(outputs) else np.zeros(0)
                compare(case["function"], found, expected)
            else:
                compare(case["function"], found.ravel(), np.array(outputs[k]))
    # The stated Jacobian equals CasADi's derivative, except at kinks.
    if case["function"].endswith("_jacobian") and case["is_smooth"]:
        dynamics = getattr(functions, case["function"].removesuffix("_jacobian"))
        symbols = [casadi.SX.sym(name, functions.LATENT_DIM) for name in case["names"]]
        derived = casadi.Function("derived", symbols, [casadi.jacobian(dynamics(*symbols), casadi.vertcat(*symbols))])
        inputs = case["inputs"][0]
        found = np.array(casadi.DM(function(*inputs)[1]).full())
        compare(case["function"], found, np.array(casadi.DM(derived(*inputs)).full()))


def main():
    library, cases = sys.argv[1:]
    loaded = {}
    check = {"numpy": check_numpy, "casadi": check_casadi}[library]
    cases = json.loads(pathlib.Path(cases).read_text())
    for case in cases:
        path = case["file"]
        functions = loaded.setdefault(path, None) or module(path)
        loaded[path] = functions
        try:
            check(case, functions)
        except Exception as error:
            raise AssertionError(f"model {case['model']}") from error
    print(f"{len(cases)} functions agree")


main()
