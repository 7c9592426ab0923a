"""Rollouts of `romc simulate` against SciPy's LSODA on the same model file and inputs.

romc writes its trajectories; this script reads the recorded latent states and inputs from them,
evaluates the candidate terms of the model file by itself, and integrates with LSODA, tightly and
sample by sample. Prints, for each model, the largest difference relative to the largest magnitude
of each latent coordinate and velocity; exits 1 beyond 1e-6.

    python examples/lsoda/compare.py --romc target/release/romc
"""

import argparse
import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from scipy.integrate import solve_ivp

ROOT = pathlib.Path(__file__).resolve().parents[2]
RECORDINGS = ROOT / "examples" / "recordings"
MODELS = [
    ("go1-d2", "go1/test_*.csv.gz"),
    ("go1-d4", "go1/test_*.csv.gz"),
    ("go1-d6", "go1/test_*.csv.gz"),
    ("go2-async-d4", "go2-asynchronous/test_*.csv.gz"),
]
BOUND = 1e-6
FUNCTIONS = {n: getattr(math, n) for n in ("sin", "cos", "tan", "tanh", "exp", "log", "sqrt")}


def romc_json(romc, *arguments):
    done = subprocess.run([romc, *map(str, arguments), "--json"], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(done.stderr)
    return json.loads(done.stdout)


class Model:
    """Accelerations of a model file, from its terms as text and its coefficients."""

    def __init__(self, romc, path):
        stored = json.loads(path.read_text())
        self.d = stored["latent_dim"]
        terms = romc_json(romc, "inspect", path)["files"][0]["library"]
        d = self.d
        names = [f"{s}{i + 1}" for s in ("z", "dz", "u") for i in range(d)]
        phases = {}
        for phase in stored["phases"]:
            sums = []
            for output in range(d):
                rows = [(row[output], term) for row, term in zip(phase["xi"], terms) if row[output]]
                sums.append(" + ".join(f"({c!r})*({t.replace('^', '**')})" for c, t in rows) or "0.0")
            code = f"lambda {', '.join(names)}: ({', '.join(sums)},)"
            phases[phase["name"]] = eval(code, {"abs": abs, **FUNCTIONS})
        self.phases = phases

    def rate(self, phase, state, u):
        return np.concatenate([state[self.d :], self.phases[phase](*state, *u)])


def columns(rows, names):
    return np.array([[float(row[name] or "nan") for name in names] for row in rows])


def integrate(model, rows, times, starts):
    """States at every sample, started again from the recorded state at `starts`."""
    d = model.d
    recorded = columns(rows, [f"z_{i + 1}" for i in range(d)] + [f"dz_{i + 1}" for i in range(d)])
    u = columns(rows, [f"u_lat_{i + 1}" for i in range(d)])
    states = [recorded[0]]
    for k in range(1, len(rows)):
        if k in starts:
            states.append(recorded[k])
            continue
        t0, t1 = times[k - 1], times[k]

        def rate(t, y, k=k, t0=t0, t1=t1):
            s = (t - t0) / (t1 - t0)
            return model.rate(rows[k - 1]["phase"], y, (1 - s) * u[k - 1] + s * u[k])

        step = solve_ivp(rate, (t0, t1), states[-1], method="LSODA", rtol=1e-11, atol=1e-14)
        states.append(step.y[:, -1])
    return np.array(states)


def restarts(times, every):
    """Samples at which romc starts again: the first not before each multiple since the last."""
    out, start = set(), 0
    for k in range(1, len(times)):
        if times[k] >= times[start] + every - 5e-7:
            out.add(k)
            start = k
    return out


def worst(romc, name, pattern, scratch):
    path = ROOT / "models" / f"{name}.json"
    model = Model(romc, path)
    table = scratch / f"{name}.csv"
    files = sorted(RECORDINGS.glob(pattern))
    romc_json(romc, "simulate", path, *files, "--output", table)
    with open(table, newline="") as file:
        rows = list(csv.DictReader(file))
    worst, steps = 0.0, 0
    for segment in sorted({row["segment"] for row in rows}, key=int):
        part = [row for row in rows if row["segment"] == segment]
        times = columns(part, ["time"])[:, 0]
        for kind, starts in (("full", set()), ("restarted", restarts(times, 0.1))):
            names = [f"{s}_{i + 1}_{kind}" for s in ("z", "dz") for i in range(model.d)]
            ours = columns(part, names)
            theirs = integrate(model, part, times, starts)
            if np.isnan(ours).any():
                sys.exit(f"{name}: a {kind} rollout of segment {segment} diverged")
            scale = np.abs(theirs).max(axis=0)
            worst = max(worst, float((np.abs(ours - theirs) / scale).max()))
            steps += len(part)
    return worst, steps


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--romc", default=str(ROOT / "target" / "release" / "romc"))
    romc = parser.parse_args().romc
    failed = False
    with tempfile.TemporaryDirectory() as scratch:
        for name, pattern in MODELS:
            difference, samples = worst(romc, name, pattern, pathlib.Path(scratch))
            print(f"{name}: {samples} samples, largest relative difference {difference:.1e}")
            failed |= not difference <= BOUND
    print(f"{'BEYOND' if failed else 'all within'} {BOUND:.0e}")
    sys.exit(failed)


if __name__ == "__main__":
    main()
