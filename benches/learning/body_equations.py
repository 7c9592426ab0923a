"""Trains models with equations of the body per phase and for all phases and prints the table of docs/evaluation/prediction.md.

    cargo build --release && python3 benches/learning/body_equations.py

Every row is a training on the jumps of a robot in `examples/recordings` and the errors of `romc simulate --verbose` along
its test jumps, of the Go1 then along `go1-other`. The last rows are baselines. About seven minutes on two cores,
most of it for d = 9 and 10, whose controllers have no structured solver; needs Python alone.
"""

import json
import pathlib
import tempfile

from whole_body import chosen_romc, jumps, run

GO1 = ("go1", "", ["go1/test_*.csv.gz", "go1-other/*.csv.gz"])
GO2 = (
    "go2-asynchronous",
    "--robot go2 --phases contact-rear-flight",
    ["go2-asynchronous/test_*.csv.gz"],
)
ROWS = [
    (GO1, "d = 4", "--latent-dim 4"),
    (GO1, "d = 6", "--latent-dim 6"),
    (GO1, "d = 7", "--latent-dim 7"),
    (GO1, "d = 9", "--latent-dim 9"),
    (GO1, "d = 6, body alone", "--latent-dim 6 --body all"),
    (GO1, "d = 10, body and feet", "--latent-dim 10 --body all"),
    (GO2, "Go2, d = 5", "--latent-dim 5"),
]
EQUATIONS = ["per-phase", "all-phases"]
BODY = [f"body.{name}" for name in ("x", "y", "z", "roll", "pitch", "yaw")]
HEAD = (
    "| | equations | recordings | x, y, z after 0.1 s, mm | roll, pitch, yaw, mrad | x, z, pitch at touchdown, mm, mrad "
    "| x, z over whole jumps, mm |\n" + "|---" * 7 + "|"
)


def main():
    romc = chosen_romc(__doc__)
    print(HEAD)
    with tempfile.TemporaryDirectory() as folder:
        baselines = {}
        for number, (of, name, flags) in enumerate(ROWS):
            for equations in EQUATIONS:
                model = pathlib.Path(folder) / f"m{number}-{equations}.json"
                train(romc, of, [*flags.split(), "--body-equations", equations], model)
                for recordings in of[2]:
                    rows = figures(romc, model, recordings)
                    print_row(name, equations, recordings, rows["rms"])
                    baselines[recordings] = rows
        for recordings, rows in baselines.items():
            for name in ("constant_velocity", "rigid_body"):
                print_row(name.replace("_", " "), "-", recordings, rows[name])


def print_row(name, equations, recordings, cells):
    print("| " + " | ".join([name, equations, recordings.split("/")[0], *cells]) + " |", flush=True)


def train(romc, of, flags, model):
    folder, robot, _ = of
    command = [romc, "train", *jumps(f"{folder}/train_*.csv.gz"), "--validation"]
    command += [*jumps(f"{folder}/validation_*.csv.gz"), *robot.split(), *flags]
    run([*command, "--output", model])


def milli(value):
    """In thousandths, two digits at least; a horizon that the recordings do not have has no value."""
    return "-" if value is None else f"{1e3 * value:.{max(2, len(str(int(1e3 * value))))}g}"


def figures(romc, model, recordings):
    """The cells of the model (`rms`) and of each baseline along some recordings."""
    answer = json.loads(run([romc, "simulate", model, *jumps(recordings), "--verbose", "--json"]))
    soon, _, _, landed = (horizon["coordinates"] for horizon in answer["horizons"])
    whole = answer["rollouts"]["full"]["coordinates"]

    def cells(kind):
        after = [milli(soon[name][kind]) for name in BODY]
        at = [milli(landed[f"body.{name}"][kind]) for name in ("x", "z", "pitch")]
        over = [milli(whole[f"body.{name}"]["rms"]) for name in ("x", "z")]
        over = over if kind == "rms" else ["-"]
        return [", ".join(part) for part in (after[:3], after[3:], at, over)]

    return {kind: cells(kind) for kind in ("rms", "constant_velocity", "rigid_body")}


if __name__ == "__main__":
    main()
