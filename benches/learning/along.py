"""Runs the controller along recordings it was not trained on and prints the tables of docs/evaluation/control.md.

    cargo build --release && python3 benches/learning/along.py

Every row has the ranges over the test jumps of `go1`, or over the jumps of `go1-other`, with the transpose lift. Needs
Python alone; a few seconds.
"""

import argparse
import pathlib

from tables import ROOT, answer, jumps, span

MODELS = ("go1-d4", "go1-d7")
SETS = {"go1": "test", "go1-other": ""}  # prefixes of the recordings
BASELINES = {
    "no dynamics": "no_dynamics",
    "constant velocity": "constant_velocity",
    "no feedback": "feedback_off",
    "replay": "replay",
}
# Column, path in the JSON object of a run, factor of its unit, decimals.
COLUMNS = [
    ("x, mm", ("prediction_rms", "body.x"), 1e3, 2),
    ("z, mm", ("prediction_rms", "body.z"), 1e3, 2),
    ("torque R^2, contact", ("torque_r2", "contact"), 1.0, 2),
    ("torque R^2, flight", ("torque_r2", "flight"), 1.0, 2),
    ("after a push, mm", ("recovery_rms_m",), 1e3, 1),
]
LIFT = [
    ("lift R^2, contact", ("lift", "torque_r2", "contact"), 1.0, 2),
    ("lift R^2, flight", ("lift", "torque_r2", "flight"), 1.0, 2),
    ("inconsistency", ("lift", "inconsistency"), 1.0, 2),
]
COMPARED = [
    "deviation as a share of that without feedback",
    "smaller than without dynamics by, mm",
    "gain of torque R^2, contact",
    "gain of torque R^2, flight",
]


def found(value, path):
    """The number of a run at a path, None where the run does not have it."""
    for key in path:
        value = value.get(key) if value else None
    return value


def cell(runs, path, factor, decimals):
    """The range of a number over runs; empty where they do not have it."""
    values = [found(run, path) for run in runs]
    return "" if None in values else span([factor * value for value in values], decimals)


def compared(title, runs):
    """The row of each run compared with its own baselines."""

    def of(path, baseline=None):
        return [found(run["baseline"][baseline] if baseline else run, path) for run in runs]

    deviation = of(("recovery_rms_m",))
    shares = [own / without for own, without in zip(deviation, of(("recovery_rms_m",), "feedback_off"))]
    smaller = [1e3 * (without - own) for own, without in zip(deviation, of(("recovery_rms_m",), "no_dynamics"))]
    cells = [span(shares, 2), span(smaller, 1)]
    for feet in ("contact", "flight"):
        path = ("torque_r2", feet)
        cells.append(span([own - without for own, without in zip(of(path), of(path, "no_dynamics"))], 2))
    return "| " + " | ".join([title, *cells]) + " |"


def row(title, runs, columns):
    return "| " + " | ".join([title] + [cell(runs, *column[1:]) for column in columns]) + " |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--romc", type=pathlib.Path, default=ROOT / "target/release/romc", help="the compiler")
    romc = parser.parse_args().romc.resolve()
    along, lift, effects = [], [], []
    for model in MODELS:
        for name in SETS:
            runs = answer(romc, "mpc", ROOT / f"models/{model}.json", *jumps(name, SETS[name]))["runs"]
            title = f"`{model}`, `{name}`"
            along.append(row(f"{title} | model", runs, COLUMNS))
            for baseline, key in BASELINES.items():
                along.append(row(f"{title} | {baseline}", [run["baseline"][key] for run in runs], COLUMNS))
            effects.append(compared(title, runs))
            if name == "go1":
                lift.append(row(f"`{model}`", runs, LIFT))
    print("\n".join(["| model, jumps | controller | " + " | ".join(column[0] for column in COLUMNS) + " |", *along]))
    print("\n".join(["", "| model | " + " | ".join(column[0] for column in LIFT) + " |", *lift]))
    print("\n".join(["", "| model, jumps | " + " | ".join(COMPARED) + " |", *effects]))


if __name__ == "__main__":
    main()
