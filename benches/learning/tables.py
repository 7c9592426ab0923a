"""Trains with and without each default and prints the tables of docs/evaluation/training-choices.md.

    cargo build --release && python3 benches/learning/tables.py

Every row is a training on the jumps of `examples/recordings/go1` and the results of `romc simulate` with the model along
its test jumps and along `go1-other`. About two minutes on two cores; needs Python alone.
"""

import argparse
import json
import pathlib
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor

ROOT = pathlib.Path(__file__).resolve().parents[2]
RECORDINGS = ROOT / "examples" / "recordings"
FREE_BODY = "--coordinates free --wrench-frame body"
TABLES = {
    "The effect of each default": [
        (4, flags)
        for flags in (
            "",
            "--refinements 0",
            "--growth 1000",
            "--slack 0.2",
            "--slack 0.05",
            "--body-weight 150000",
            "--coordinates free",
            "--wrench-frame world",
            "--wrench-frame body",
            FREE_BODY,
            "--no-rotation",
            "--mask-std 0",
            "--body-weight 1",
            "--coordinates free --body-weight 1",
            "--force-scaling 0.1 --moment-scaling 0.1",
            "--lift-weight 0",
            "--actuators none",
        )
    ],
    "The same with other dimensions": [
        (2, ""),
        (2, "--lift-weight 0"),
        (2, "--coordinates free"),
        (2, FREE_BODY),
        (6, ""),
        (6, "--refinements 0"),
        (6, "--growth 1000"),
        (6, "--slack 0.2"),
        (6, "--slack 0.05"),
        (6, "--coordinates free"),
        (6, FREE_BODY),
        (6, "--wrench-frame world"),
        (6, "--actuators none"),
        (7, ""),
        (7, "--refinements 0"),
        (7, "--wrench-frame world"),
        (7, "--actuators none"),
    ],
    "Richer libraries": [
        (4, ""),
        (4, "--degree 2"),
        (4, "--trigonometric"),
        (6, ""),
        (6, "--degree 2"),
    ],
}
HEAD = (
    "| | x, z after 0.1 s, mm | x, z over whole jumps, mm | torque R^2 of the lift | terms "
    "| other: 0.1 s | other: whole jumps | other: R^2 |\n|---|---|---|---|---|---|---|---|"
)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--romc", type=pathlib.Path, default=ROOT / "target" / "release" / "romc")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:

        def row(numbered):
            number, (dimension, flags) = numbered
            model = pathlib.Path(folder) / f"model-{number}.json"
            return measured(arguments.romc, model, dimension, flags)

        for title, rows in TABLES.items():
            print(f"\n{title}\n\n{HEAD}")
            with ThreadPoolExecutor(2) as pool:
                for line in pool.map(row, enumerate(rows)):
                    print(line, flush=True)


def measured(romc, model, dimension, flags):
    """A row of a table: trains, rolls out along both test sets."""
    train = [*jumps("go1", "train"), "--validation", *jumps("go1", "validation")]
    train += ["--latent-dim", str(dimension), "--output", model, "--force", *flags.split()]
    label = f"d = {dimension}" + f", `{flags}`" * bool(flags)
    trained = subprocess.run([romc, "train", *train], capture_output=True, text=True)
    if trained.returncode:
        return f"| {label} | {trained.stderr.strip().splitlines()[-1]} |"
    ours = rollouts(romc, model, jumps("go1", "test"))
    other = rollouts(romc, model, jumps("go1-other", ""))
    report = json.loads(model.read_text())["provenance"]["report"]
    terms = " + ".join(str(phase["active"]) for phase in report["active_terms"])
    cells = [label, *errors(ours), lift(ours), terms, *errors(other), lift(other)]
    return f"| {' | '.join(cells)} |"


def jumps(folder, prefix):
    return sorted((RECORDINGS / folder).glob(f"{prefix}*.csv.gz"))


def rollouts(romc, model, recordings):
    return answer(romc, "simulate", model, *recordings)["rollouts"]


def answer(romc, *arguments):
    """The JSON object of a command; one that fails its verdict has it also, with exit code 1."""
    done = subprocess.run([romc, *arguments, "--json"], capture_output=True, text=True)
    if not done.stdout:
        raise SystemExit(done.stderr)
    return json.loads(done.stdout)


def span(values, decimals):
    """The range of numbers, one number where both ends are printed alike."""
    least, most = (f"{value:.{decimals}f}" for value in (min(values), max(values)))
    return least if least == most else f"{least} to {most}"


def errors(rollouts):
    """Body x and z in mm: after 0.1 s, and over whole jumps."""
    for kind in ("restarted", "full"):
        coordinates = rollouts[kind]["coordinates"]
        yield ", ".join(rounded(1e3 * coordinates[f"body.{axis}"]["rms"]) for axis in "xz")


def lift(rollouts):
    return f"{rollouts['lift']['torque_r2']['all']:.2f}"


def rounded(value):
    """Two significant digits, and whole numbers from ten on."""
    return f"{value:.0f}" if value >= 9.95 else f"{value:.1f}" if value >= 0.995 else f"{value:.2f}"


if __name__ == "__main__":
    main()
