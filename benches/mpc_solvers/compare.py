"""Other solvers on the controller's problems: times, iterations, distance from its solution.

    cargo bench --bench mpc -- --dump problems.jsonl           # add --along: no limit is active
    python -m venv venv && venv/bin/pip install -r benches/mpc_solvers/requirements.txt
    venv/bin/python benches/mpc_solvers/compare.py problems.jsonl

Each solver is set up once per jump (the rows that matter differ between jumps) and then only updated,
as the controller does it. Times are those of this thread's CPU clock for update and solve. Each solver
runs alone, and its input is converted to its own form before.

The last rows are times of the controller with romc's structured solver, which the bench measured when it
wrote the problems. They are a whole step, including linearisation, gains and lift, and the step alone
after `Controller::prepare`, which linearises and computes the gains between two steps. `x whole` and
`x prepared` are the ratios of a solver's median time to these.
"""

import json
import sys
import time

import numpy as np
import osqp
import piqp
from scipy import sparse

INFINITY = 1e20


def matrix(stored):
    parts = (stored["data"], stored["indices"], stored["indptr"])
    return sparse.csc_matrix(parts, shape=stored["shape"])


def rows_apart(problem):
    """The problem in the form of PIQP: equalities and inequalities as separate matrices."""
    n, b = problem["equalities"], problem["b"]
    rows = problem["A"].tocsr()
    lower = np.full(len(b) - n, -np.inf)
    return problem["P"], problem["q"], rows[:n].tocsc(), b[:n], rows[n:].tocsc(), lower, b[n:]


def read(path):
    """Problems min x'Px/2 + q'x subject to Ax = b in the first rows, Ax <= b in the others."""
    with open(path, encoding="utf-8") as lines:
        for line in lines:
            stored = json.loads(line)
            problem = {
                "P": matrix(stored["P"]),
                "q": np.array(stored["q"]),
                "A": matrix(stored["A"]),
                "b": np.array(stored["b"]),
                "equalities": stored["equalities"],
                "solution": np.array(stored["solution"]),
                "own_us": stored["own_us"],
                "prepared_us": stored["prepared_us"],
            }
            problem["rows apart"] = rows_apart(problem)
            yield problem


class Osqp:
    def __init__(self, tolerance):
        self.settings = {"eps_abs": tolerance, "eps_rel": tolerance, "max_iter": 20000}
        self.solver = None

    def solve(self, problem):
        upper = problem["b"]
        lower = np.full_like(upper, -INFINITY)
        lower[: problem["equalities"]] = upper[: problem["equalities"]]
        if self.solver is None:
            self.solver = osqp.OSQP()
            self.solver.setup(
                problem["P"], problem["q"], problem["A"], lower, upper, verbose=False, **self.settings
            )
        else:
            self.solver.update(
                q=problem["q"], l=lower, u=upper, Px=problem["P"].data, Ax=problem["A"].data
            )
        result = self.solver.solve()
        return result.x, result.info.iter


class Piqp:
    def __init__(self, tolerance):
        self.tolerance = tolerance
        self.solver = None

    def solve(self, problem):
        arguments = problem["rows apart"]
        if self.solver is None:
            self.solver = piqp.SparseSolver()
            self.solver.settings.eps_abs = self.tolerance
            self.solver.settings.eps_rel = self.tolerance
            self.solver.setup(*arguments)
        else:
            self.solver.update(*arguments)
        self.solver.solve()
        return np.array(self.solver.result.x), self.solver.result.info.iter


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    problems = list(read(sys.argv[1]))
    solvers = {
        "OSQP 1e-3": Osqp(1e-3),
        "OSQP 1e-6": Osqp(1e-6),
        "PIQP 1e-6": Piqp(1e-6),
        "PIQP 1e-8": Piqp(1e-8),
    }
    print(f"{len(problems)} problems; CPU time of update and solve in us; `off` is the largest")
    print("distance of an unknown from the controller's, all unknowns being scaled to about one")
    own, prepared = ([problem[key] for problem in problems] for key in ("own_us", "prepared_us"))
    print(f"{'':<12}{'median':>9}{'p99':>9}{'iterations':>12}{'median off':>12}{'p99 off':>10}{'x whole':>9}{'x prepared':>12}")
    for name, solver in solvers.items():
        times, iterations, off = [], [], []
        pattern = None
        for problem in problems:
            if pattern != (problem["A"].shape, problem["A"].nnz):
                pattern = (problem["A"].shape, problem["A"].nnz)
                solver.solver = None
                solver.solve(problem)
            started = time.thread_time_ns()
            x, count = solver.solve(problem)
            times.append((time.thread_time_ns() - started) * 1e-3)
            iterations.append(count)
            off.append(np.abs(x - problem["solution"]).max())
        print(
            f"{name:<12}{np.median(times):>9.0f}{np.percentile(times, 99):>9.0f}"
            f"{np.median(iterations):>12.0f}{np.median(off):>12.1e}{np.percentile(off, 99):>10.1e}"
            f"{np.median(times) / np.median(own):>9.1f}{np.median(times) / np.median(prepared):>12.1f}"
        )
    for name, times in (("romc", own), ("prepared", prepared)):
        print(f"{name:<12}{np.median(times):>9.1f}{np.percentile(times, 99):>9.1f}")


if __name__ == "__main__":
    main()
