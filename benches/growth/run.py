#!/usr/bin/env python3
"""How time and memory of `romc compile` and `romc train` grow with the size of their input.

Compiles dense cubic models of 2 to 16 latent coordinates to LaTeX, C and Rust, and trains in closed
form on copies of the recorded jumps. Prints the tables of docs/evaluation/code-speed.md. Standard library of
Python alone; Linux or macOS.
"""

import argparse
import itertools
import json
import os
import pathlib
import random
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
JUMPS = sorted((ROOT / "examples/recordings/go1").glob("train_*.csv.gz"))
VALIDATION = sorted((ROOT / "examples/recordings/go1").glob("validation_*.csv.gz"))


def measured(command):
    """Seconds of processor time and peak memory in MB of a command that must succeed."""
    output = os.open(os.devnull, os.O_WRONLY)
    actions = [(os.POSIX_SPAWN_DUP2, output, 1)]
    pid = os.posix_spawn(command[0], [str(part) for part in command], os.environ, file_actions=actions)
    started = time.monotonic()
    _, status, usage = os.wait4(pid, 0)
    wall = time.monotonic() - started
    os.close(output)
    if status != 0:
        sys.exit(f"failed: {' '.join(map(str, command))}")
    unit = 1e6 if sys.platform == "darwin" else 1e3
    return usage.ru_utime + usage.ru_stime, wall, usage.ru_maxrss / unit


def dense_cubic(latent_dim):
    """A model in which every equation has every monomial up to degree three, sines and cosines."""
    variables = [f"{symbol}{i + 1}" for symbol in ("z", "dz") for i in range(latent_dim)]
    terms = ["1"]
    for degree in (1, 2, 3):
        terms += map("*".join, itertools.combinations_with_replacement(variables, degree))
    terms += [f"{function}({v})" for function in ("sin", "cos") for v in variables]
    terms += [f"u{i + 1}" for i in range(latent_dim)]
    source = random.Random(latent_dim)
    xi = [[source.gauss(0, 1) for _ in range(latent_dim)] for _ in terms]
    phase = {"name": "phase", "feet": "any", "xi": xi}
    return {
        "schema": "romc-model/1",
        "name": f"cubic-{latent_dim}",
        "latent_dim": latent_dim,
        "library": terms,
        "phases": [phase],
    }


def compile_rows(romc, dimensions, scratch):
    for latent_dim in dimensions:
        model = dense_cubic(latent_dim)
        path = scratch / f"{model['name']}.json"
        path.write_text(json.dumps(model))
        out = scratch / f"out-{latent_dim}"
        seconds, _, memory = measured(
            [romc, "compile", path, "--emit", "latex,c,rust", "--out-dir", out]
        )
        coefficients = len(model["library"]) * latent_dim
        written = sum(file.stat().st_size for file in out.rglob("*") if file.is_file())
        share = 1e6 * seconds / coefficients
        yield f"| {coefficients:,} | {seconds:.2f} | {share:.0f} | {memory:.0f} | {written / 1e6:.1f} |"


def training_rows(romc, counts, scratch):
    for count in counts:
        folder = scratch / f"jumps-{count}"
        folder.mkdir()
        for copy in range(count):
            (folder / f"{copy:05}.csv.gz").symlink_to(JUMPS[copy % len(JUMPS)])
        seconds, wall, memory = measured(
            [romc, "train", *sorted(folder.iterdir()), "--validation", *VALIDATION, "--latent-dim", 4,
             "--method", "closed-form", "--output", scratch / f"model-{count}.json"]
        )
        yield f"| {count} | {seconds:.1f} | {1e3 * seconds / count:.0f} | {wall:.1f} | {memory:.0f} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--romc", default=str(ROOT / "target/release/romc"))
    parser.add_argument("--dimensions", type=int, nargs="*", default=[2, 4, 8, 12, 16])
    parser.add_argument("--jumps", type=int, nargs="*", default=[70, 200, 700])
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        scratch = pathlib.Path(scratch)
        if given.dimensions:
            print("| coefficients | CPU s | µs per coefficient | peak MB | emitted MB |\n|---|---|---|---|---|")
            for row in compile_rows(given.romc, given.dimensions, scratch):
                print(row, flush=True)
            print()
        if given.jumps:
            print("| jumps | CPU s | ms per jump | wall s | peak MB |\n|---|---|---|---|---|")
            for row in training_rows(given.romc, given.jumps, scratch):
                print(row, flush=True)


if __name__ == "__main__":
    main()
