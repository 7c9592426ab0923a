"""Trains linear and nonlinear encoders and prints the tables of docs/evaluation/nonlinear.md.

    cargo build --release && python3 benches/learning/nonlinear.py

Models are trained on the jumps of `examples/recordings/go1`, without joint friction and rotor inertia. Predictions and
control are those along its test jumps. About three minutes on two cores; needs Python alone.
"""

import json
import pathlib
import subprocess
import tempfile

from tables import FREE_BODY, ROOT, answer, errors, jumps, rollouts, span

NETWORK = "--encoder-layers 32,16 --seeds 1"
# Title, latent dimension, options of `romc train`, and whether the controller is run.
ROWS = [
    ("d = 2, linear", 2, FREE_BODY, True),
    ("d = 2, elu", 2, f"{FREE_BODY} {NETWORK}", True),
    ("d = 4, linear", 4, FREE_BODY, True),
    ("d = 4, elu", 4, f"{FREE_BODY} {NETWORK}", True),
    ("d = 4, elu, `--degree 2`", 4, f"{FREE_BODY} {NETWORK} --degree 2", False),
    ("d = 4, tanh", 4, f"{FREE_BODY} {NETWORK} --activation tanh", False),
    ("d = 2, named", 2, "", False),
    ("d = 4, named", 4, "", False),
]
PREDICTIONS = (
    "| | decoder mean square | x, z over 0.1 s, mm | x, z over the whole motion, mm "
    "| torque R^2 of the transpose lift | active terms, contact + flight |\n|---|---|---|---|---|---|"
)
CONTROL = (
    "| | recorded input, contact | recorded input, flight | own input, contact | own input, flight "
    "| time of a step |\n|---|---|---|---|---|---|"
)


def train(romc, model, dimension, flags):
    """Trains a model; returns the torque R^2 of the lift on the validation jumps and the active terms of each phase."""
    command = [romc, "train", *jumps("go1", "train"), "--validation", *jumps("go1", "validation")]
    command += ["--actuators", "none", "--latent-dim", str(dimension), "--output", model, "--force", *flags.split()]
    subprocess.run(command, check=True, capture_output=True, text=True)
    report = json.loads(model.read_text())["provenance"]["report"]
    return report["validation"]["torque_r2"], " + ".join(str(phase["active"]) for phase in report["active_terms"])


def main():
    romc = ROOT / "target" / "release" / "romc"
    driven, step_us = [], None
    print(PREDICTIONS)
    with tempfile.TemporaryDirectory() as folder:
        for number, (title, dimension, flags, is_driven) in enumerate(ROWS):
            model = pathlib.Path(folder) / f"model-{number}.json"
            lift_r2, terms = train(romc, model, dimension, flags)
            found = rollouts(romc, model, jumps("go1", "test"))
            cells = [title, f"{found['decoder_mean_square_scaled']:.1e}", *errors(found), f"{lift_r2:.2f}", terms]
            print(f"| {' | '.join(cells)} |", flush=True)
            if is_driven:
                runs = answer(romc, "mpc", model, *jumps("go1", "test"))["runs"]
                r2 = [
                    span([of(run)[phase] for run in runs], 2)
                    for of in (lambda run: run["lift"]["commanded_torque_r2"], lambda run: run["torque_r2"])
                    for phase in ("contact", "flight")
                ]
                median_us = sorted(run["step_us"]["p50"] for run in runs)[len(runs) // 2]
                step_us = step_us or median_us
                driven.append(f"| {' | '.join([title, *r2, f'{median_us / step_us:.1f}'])} |")
    print("\n".join(["", CONTROL, *driven]))


if __name__ == "__main__":
    main()
