"""Trains models of the whole body, each without a part of the recipe, and prints the table of docs/evaluation/training-choices.md.

    cargo build --release && python3 benches/learning/whole_body.py

Every row is a training on the jumps of `examples/recordings/go1` and the errors of `romc simulate --verbose` along its
test jumps, then along `go1-other`. About three minutes on two cores; needs Python alone.
"""

import argparse
import json
import pathlib
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
RECORDINGS = ROOT / "examples" / "recordings"
SETS = ("go1/test_*.csv.gz", "go1-other/*.csv.gz")
ROWS = [
    (7, "", "d = 7"),
    (
        7,
        "--wrench-frame world",
        "feet that pull, the legs' own weight in the inputs, rotors' inertia as a loss in flight",
    ),
    (7, "--actuators LOSSES", "the legs' own weight in the inputs"),
    (7, "--actuators none", "torques of the motors"),
    (7, "--coordinates free", "no known rows and equations"),
    (6, "", "d = 6: no known rows of the legs"),
    (4, "", "d = 4: no row of the rotation"),
    (7, "--leave-out momentum-weights", "momentum rows: coordinates of the trunk"),
    (7, "--leave-out leg-rows", "learned rows instead of feet"),
    (7, "--leave-out abductions", "rows of feet without abductions"),
    (7, "--leave-out settling", "rows of feet from touchdowns on"),
    (7, "--leave-out place", "terms of `z1`"),
    (7, "--leave-out positions", "positions in `ddz1`, `ddz2`"),
    (7, "--leave-out height", "all velocities and inputs in `ddz2`"),
    (7, "--leave-out kept-constant", "the constant of `ddz2` may be eliminated"),
    (7, "--leave-out kept-velocities", "own velocity in `ddz1`, `ddz2` may be eliminated"),
    (7, "--leave-out braking", "own velocity may drive"),
    (7, "--leave-out kept-inputs", "own input in `ddz1`, `ddz2` may be eliminated"),
    (7, "--leave-out rotation-positions", "positions in `ddz3`"),
    (7, "--leave-out rotation-legs", "inputs of legs in `ddz3`"),
    (7, "--leave-out kept-rotation", "terms of `ddz3` may be eliminated"),
    (7, "--leave-out stance-prior", "legs in contact regressed, eliminated and refined as other rows"),
    (7, "--leave-out still-feet", "legs in contact by the ridge towards 0"),
    (7, "--leave-out stiffness", "prior of the feet without stiffness"),
    (7, "--leave-out unrefined-legs", "legs in contact refined by rollouts"),
    (7, "--leave-out free-fall", "flight: `ddz1`, `ddz2` regressed"),
    (7, "--leave-out flight-rotation", "flight: `ddz3` regressed"),
    (7, "--leave-out flight-loads", "flight: force and moment in the legs' equations"),
    (7, "--leave-out flight-legs", "flight: the state in the legs' equations"),
    (7, "--leave-out flight-fit", "flight: legs regressed and refined as other rows"),
    (7, "--leave-out whole-flights", "flight: legs fitted to windows alone"),
    (7, "--leave-out whole-jumps", "all coordinates count over whole jumps"),
    (7, "--leave-out relative-errors", "errors in standard deviations"),
    (7, "--leave-out windows", "regression of accelerations alone"),
    (7, "--moving-average 1", "accelerations of single samples"),
    (7, "--leave-out thresholds", "no candidates by thresholds"),
    (7, "--leave-out sweep", "no terms dropped before the refinement"),
    (7, "--leave-out thinning", "no terms dropped after it"),
    (
        7,
        "--leave-out height,kept-constant,braking,kept-inputs,thresholds,sweep,thinning",
        "all seven without an effect",
    ),
    (7, "--slack 0.1", "slack of lower dimensions"),
    (7, "--refinements 0", "no refinement"),
    (7, "--growth 1000", "no bound on growth"),
]
CELLS = [
    "x, z, mm",
    "pitch R^2, 0.1 and 0.2 s",
    "R^2: legs, lift",
    "pitch, knees at touchdown, mrad",
    "whole jumps: x, z, mm, pitch, mrad",
]
HEAD = "| | " + " | ".join(CELLS + [f"other: {name}" for name in CELLS]) + " |\n" + "|---" * 11 + "|"


def main():
    romc = chosen_romc(__doc__)
    print(HEAD)
    with tempfile.TemporaryDirectory() as folder:
        losses = pathlib.Path(folder) / "losses.toml"
        without_legs(romc, losses)
        for number, (dimension, flags, name) in enumerate(ROWS):
            model = pathlib.Path(folder) / f"m{number}.json"
            train = [romc, "train", *jumps("go1/train_*.csv.gz"), "--validation"]
            train += [*jumps("go1/validation_*.csv.gz"), "--latent-dim", dimension]
            train += flags.replace("LOSSES", str(losses)).split()
            run([*train, "--output", model])
            cells = [cell for of in SETS for cell in figures(romc, model, jumps(of))]
            shown = f"{name}, `{flags}`" if flags else name
            print("| " + " | ".join([shown, *cells]) + " |", flush=True)


def chosen_romc(description):
    """The compiler that the command line names."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--romc", type=pathlib.Path, default=ROOT / "target" / "release" / "romc")
    return parser.parse_args().romc.resolve()


def without_legs(romc, path):
    """Writes the result of `romc identify` on the training jumps without the moments of the legs."""
    run([romc, "identify", "--robot", "go1", *jumps("go1/train_*.csv.gz"), "--output", path])
    tables = path.read_text(encoding="utf-8").split("\n[")
    path.write_text("\n[".join(t for t in tables if not t.startswith("legs]")), encoding="utf-8")


def jumps(pattern):
    return sorted(RECORDINGS.glob(pattern))


def run(command):
    """The answer of a command, whose verdict may be that the model fails."""
    done = subprocess.run([str(part) for part in command], cwd=ROOT, capture_output=True, text=True)
    if not done.stdout:
        raise SystemExit(done.stderr)
    return done.stdout


def figures(romc, model, recordings):
    """The cells of one set of recordings."""
    answer = json.loads(run([romc, "simulate", model, *recordings, "--verbose", "--json"]))
    soon, later, _, landed = (horizon["coordinates"] for horizon in answer["horizons"])
    legs = [name for name in soon if name.endswith((".hy", ".kn"))]
    knees = [landed[name]["rms"] for name in legs if name.endswith(".kn")]
    knee = (sum(rms * rms for rms in knees) / len(knees)) ** 0.5
    x, z = (1e3 * soon[name]["rms"] for name in ("body.x", "body.z"))
    pitch = [coordinates["body.pitch"]["r2"] for coordinates in (soon, later)]
    rollouts = answer["rollouts"]
    full = rollouts["full"]["coordinates"]
    whole = (1e3 * full[f"body.{name}"]["rms"] for name in ("x", "z", "pitch"))
    return [
        f"{x:.2f}, {z:.2f}",
        f"{pitch[0]:.3f}, {pitch[1]:.2f}",
        f"{min(soon[name]['r2'] for name in legs):.3f}, {rollouts['lift']['torque_r2']['all']:.2f}",
        f"{1e3 * landed['body.pitch']['rms']:.1f}, {1e3 * knee:.0f}",
        ", ".join(f"{error:.{1 if error < 10 else 0}f}" for error in whole),
    ]


if __name__ == "__main__":
    main()
