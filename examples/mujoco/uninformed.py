"""A copy of a model without the robot's dynamics: `ddz = g u_lat` in every phase.

Encoder, decoder, phases and input statistics stay. The one number g of a phase is the least-squares
fit to training jumps, in the scaled units of the model file, so that a controller on the copy has
only the right scale. The error of its accelerations is its own. Any advantage of a controller on the
model itself is due to Xi.
"""

import json

import numpy as np

from followers import Jump
from recording_format import read_recording, states_of
from simulation import CONTROL_STEP_S

# Accelerations are differences of velocities over so many samples: touchdown rings otherwise.
DIFFERENCE_SAMPLES = 10


def write_uninformed(model_path, output, recordings, inputs):
    """Writes the copy of a model file; returns {phase: g}. Shapes as in the model file.

    `inputs` gives the (rows, 18) input of a Jump by the model's rule. The copy keeps the prior of the
    training jumps, but not how accelerations change about it.
    """
    model = json.loads(model_path.read_text(encoding="utf-8"))
    latent_dim = model["latent_dim"]
    samples = [scaled_samples(model_path, model, path, inputs) for path in recordings]
    gains = {}
    for phase in model["phases"]:
        chosen = [(ddz[of], u[of]) for ddz, u, feet in samples for of in [in_phase(phase, feet)]]
        ddz, u = (np.concatenate(parts) for parts in zip(*chosen, strict=True))
        if len(u) == 0:
            raise SystemExit(f"{model_path}: phase `{phase['name']}` is in none of the recordings")
        gain = float((ddz * u).sum() / (u * u).sum())
        gains[phase["name"]] = gain
        given_state = model["input_statistics"][phase["name"]].get("given_state")
        if given_state:
            error = ddz - gain * u
            given_state["acceleration_error"] = (error.T @ error / len(error)).tolist()
        phase["xi"] = (gain * np.eye(latent_dim)).tolist()
    model["library"] = [f"u{k + 1}" for k in range(latent_dim)]
    for part in model.get("prior", {}).get("parts", []):
        part.pop("xi", None)
    model["name"] = f"{model['name']}-uninformed"
    model["description"] = "the same maps, ddz = g u_lat in place of the dynamics"
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(json.dumps(model), encoding="utf-8")
    return gains


def scaled_samples(model_path, model, recording, inputs):
    """(rows, d) ddz, (rows, d) u_lat, (rows, 4) feet of a recording, both scaled."""
    if set(model["encoder"]) != {"weights", "bias"}:
        raise SystemExit(f"{model_path}: the encoder has layers, not one matrix of weights")
    columns = read_recording(recording)
    x, dx, _, torque_nm, feet = states_of(columns)
    jump = Jump(recording.name, columns["Time"], x, dx, torque_nm, feet)
    encoder = np.array(model["encoder"]["weights"])
    half = DIFFERENCE_SAMPLES // 2
    rows = slice(half, -half)
    span_s = 2 * half * CONTROL_STEP_S
    ddx = (dx[2 * half :] - dx[: -2 * half]) / span_s
    u = inputs(jump)[rows] * model["scaling"]["input"]
    ddz = model["scaling"]["state"] * ddx @ encoder.T
    return ddz, u @ np.linalg.pinv(encoder.T).T, feet[rows]


def in_phase(phase, feet):
    """(rows,) whether the feet are those of a phase: `any`, `none`, or a list of patterns."""
    rule = phase["feet"]
    if rule == "any":
        return feet.any(axis=1)
    if rule == "none":
        return ~feet.any(axis=1)
    patterns = np.array(rule, dtype=bool)
    return (feet[:, None, :] == patterns[None]).all(axis=2).any(axis=1)
