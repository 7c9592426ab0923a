"""Records walks by other seeds than those of the repository and prints how well a shipped model predicts them.

Values are root mean square errors over restarts, of the centre of mass (mm), of the rotation about it (mrad), and of
the trunk.
"""

import argparse
import itertools
import json
import pathlib
import subprocess
from dataclasses import replace

from gait_sets import GAIT_SETS, stems_of
from parallel import results_of
from record_gaits import write_walk
from walk_loop import ROMC, ROOT

EXAMPLE = """example:
  cargo build --release
  python fresh_walks.py --seeds 11 12 13
records 30 walks of three sets for each seed (ten minutes on two cores) and predicts them by models/go1-trot-d12.json."""
# Title -> data set and prefix of its recordings.
SETS = {
    "trots": ("go1-trot", ""),
    "other trots": ("go1-trot-other", ""),
    "crawls": ("go1-gaits", "crawl"),
    "pronks": ("go1-gaits", "pronk"),
}
HORIZONS = ("0.1 s", "stride")
COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")
# Row of a table -> bodies and the key of their errors.
ROWS = {
    "centre of mass": ("com", "rms"),
    "constant velocity": ("com", "constant_velocity"),
    "rigid body": ("com", "rigid_body"),
    "trunk": ("body", "rms"),
    "trunk, constant velocity": ("body", "constant_velocity"),
}


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--model", type=pathlib.Path, default=ROOT / "models/go1-trot-d12.json")
    parser.add_argument("--romc", type=pathlib.Path, default=ROMC, help="the compiler")
    parser.add_argument("--out-dir", type=pathlib.Path, default=ROOT / "out/fresh_walks")
    parser.add_argument("--seeds", type=int, nargs="+", default=[11, 12, 13], help="of the walks")
    parser.add_argument("--jobs", type=int, help="walks at a time (default: one per core)")
    arguments = parser.parse_args()
    for seed in arguments.seeds:
        if any(seed == gait_set.seed for gait_set in GAIT_SETS.values()):
            raise SystemExit(f"--seeds: {seed} is the seed of a set in the repository; choose another")
    refuse_other_models(arguments)
    record(arguments)
    answers = [answer_for(arguments, recordings(arguments, *of)) for of in SETS.values()]
    for horizon in HORIZONS:
        print(table(horizon, answers))


def refuse_other_models(arguments):
    """Stops before minutes of recording unless the model's equations are those of the whole body."""
    (horizon, *_) = answer_for(arguments, [ROOT / "examples/recordings/go1-trot/test_02.csv.gz"])["horizons"]
    missing = [f"com.{axis}" for axis in COORDINATES if f"com.{axis}" not in horizon["coordinates"]]
    if missing:
        raise SystemExit(f"{arguments.model}: found no {', '.join(missing)}, expected a model of walks with --body all")


def folder(arguments, name, seed):
    return arguments.out_dir / f"{name}-{seed}"


def record(arguments):
    """Records all walks of all sets."""
    tasks = []
    for name in {name for name, _ in SETS.values()}:
        for seed in arguments.seeds:
            gait_set = replace(GAIT_SETS[name], seed=seed, refused={})
            folder(arguments, name, seed).mkdir(parents=True, exist_ok=True)
            indices = range(len(stems_of(gait_set)))
            tasks += [(gait_set, index, folder(arguments, name, seed)) for index in indices]
    results_of(recorded, tasks, arguments.jobs)


def recorded(task):
    write_walk(*task)


def recordings(arguments, name, prefix):
    """The recordings of a set, of all seeds."""
    folders = [folder(arguments, name, seed) for seed in arguments.seeds]
    return [path for one in folders for path in sorted(one.glob(f"{prefix}*.csv.gz"))]


def table(horizon, answers):
    """Errors after a horizon of `romc simulate`, a row for each set and predictor."""
    lines = []
    for title, answer in zip(SETS, answers, strict=True):
        # Crawls have no errors over a stride: a foot touches down less than three times in a recording.
        found = [one["coordinates"] for one in answer["horizons"] if one["name"].startswith(horizon)]
        for errors, (row, (body, key)) in itertools.product(found, ROWS.items()):
            values = [errors[f"{body}.{axis}"].get(key) for axis in COORDINATES]
            cells = ["-" if value is None else rounded(1e3 * value) for value in values]
            lines.append(f"| {title} | {row} | {' | '.join(cells)} |")
    head = f"| {horizon} | | {' | '.join(COORDINATES)} |\n|---|---|" + "---:|" * len(COORDINATES)
    return "\n".join([head, *lines, ""])


def rounded(value):
    """With two significant digits, or all before the point."""
    return f"{value:.0f}" if value >= 9.95 else f"{value:#.2g}"


def answer_for(arguments, walks):
    """The JSON of `romc simulate` for recorded walks."""
    command = [arguments.romc, "simulate", arguments.model, *walks, "--verbose", "--json"]
    try:
        result = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
    except FileNotFoundError:
        raise SystemExit(f"{arguments.romc}: no such program; `cargo build --release` makes it") from None
    # A model that is not fit for the recordings ends with 1, after its answer.
    if result.returncode not in (0, 1) or not result.stdout:
        raise SystemExit(f"romc simulate: {result.stderr.strip()}")
    return json.loads(result.stdout)


if __name__ == "__main__":
    main()
