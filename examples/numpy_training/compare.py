"""Times the published training in NumPy and in romc, side by side on this machine.

    python examples/numpy_training/compare.py            (from the repository's root)

Both train encoder, decoder and Xi with the published schedule (501 + 101 epochs a step) on the training jumps of
`examples/recordings/go1`, one seed, d = 4. The gradient of the NumPy version is first checked against differences.
"""

import argparse
import glob
import json
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

import recordings
import training


def check_gradient(batch):
    """Complains unless the gradient agrees with central differences of the losses."""
    rng = np.random.default_rng(3)
    parameters = training.start(18, 4, rng)
    weights = (1.0, training.WEIGHT_DDZ, training.WEIGHT_DDX, training.WEIGHT_L1)

    def loss():
        return np.dot(weights, training.joint_gradient(parameters, batch, training.WEIGHT_L1)[0])

    _, gradient = training.joint_gradient(parameters, batch, training.WEIGHT_L1)
    for block, g in zip(parameters, gradient):
        index = tuple(rng.integers(0, size) for size in block.shape)
        kept = block[index]
        block[index] = kept + 1e-5
        above = loss()
        block[index] = kept - 1e-5
        difference = (above - loss()) / 2e-5
        block[index] = kept
        assert abs(difference - g[index]) < 1e-4 * max(abs(g[index]), 1e-4), (difference, g[index])


def time_numpy(contact, flight, d):
    """Seconds of each step, and the decoder's mean square error at the end."""
    parameters = training.start(18, d, np.random.default_rng(1))
    seconds, began = [], time.perf_counter()
    for step in (
        lambda: training.step_one(parameters, contact),
        lambda: training.step_two(parameters, contact + flight),
        lambda: [training.step_three(parameters, phase) for phase in (contact, flight)],
    ):
        step()
        seconds.append(time.perf_counter() - began)
        began = time.perf_counter()
    encoder, encoder_bias, decoder, decoder_bias, _ = parameters
    miss = [(x @ encoder + encoder_bias) @ decoder + decoder_bias - x for x, *_ in contact + flight]
    return seconds, np.mean(np.square(miss))


def time_romc(paths, d):
    """Seconds of `romc train`, reading and writing included, and its report."""
    with tempfile.TemporaryDirectory() as folder:
        command = ["target/release/romc", "train", *paths, "--latent-dim", str(d)]
        command += ["--method", "joint", "--paper", "--seed", "1", "--json", "--output", f"{folder}/model.json"]
        began = time.perf_counter()
        answer = subprocess.run(command, check=True, capture_output=True, text=True)
        return time.perf_counter() - began, json.loads(answer.stdout)["report"]


def main():
    """Measures both and prints the ratio."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--latent-dim", type=int, default=4)
    parser.add_argument("--recordings", default="examples/recordings/go1/train_*.csv.gz")
    arguments = parser.parse_args()
    paths = sorted(glob.glob(arguments.recordings))
    subprocess.run(["cargo", "build", "--quiet", "--release"], check=True)
    contact, flight = recordings.batches([Path(path) for path in paths])
    check_gradient(contact[0])
    print(f"{len(contact)} contact and {len(flight)} flight batches, d = {arguments.latent_dim}")
    seconds, error = time_numpy(contact, flight, arguments.latent_dim)
    print("NumPy: " + " + ".join(f"{s:.1f}" for s in seconds) + f" = {sum(seconds):.1f} s, decoder {error:.2e}")
    romc, report = time_romc(paths, arguments.latent_dim)
    print(f"romc:  {romc:.1f} s, decoder {report['training']['decoder_mse']:.2e}")
    print(f"romc is {sum(seconds) / romc:.1f} times faster")


if __name__ == "__main__":
    main()
