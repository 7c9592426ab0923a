"""Rows of roll and yaw of a trained encoder, compared with the mass matrix of the simulated robot."""

import argparse
import json
import pathlib

import mujoco
import numpy as np

from closed_loop import read_jump
from robot_model import JOINTS, RobotModel
from simulation import write_state

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
EXAMPLE = """example:
  romc train ... --latent-dim 10 --body all --output d10.json
  python momentum_rows.py d10.json
Angular momentum about the centre of mass is conserved in flight: a turn of the joints turns the trunk by the
weights that the mass matrix at the mean posture of the flights gives. Prints both for the right legs."""


def of_mass_matrix(robot, state):
    """(3, 12) weights of the joints in the trunk's rotation (roll, pitch, yaw) with the momentum kept."""
    data = mujoco.MjData(robot.mj)
    write_state(robot, data, state)
    mujoco.mj_forward(robot.mj, data)
    full = np.zeros((robot.mj.nv, robot.mj.nv))
    mujoco.mj_fullM(robot.mj, data, full)
    # The trunk's translation is free: it is eliminated, which leaves the momentum about the centre of mass.
    rest = full[3:, 3:] - full[3:, :3] @ np.linalg.solve(full[:3, :3], full[:3, 3:])
    return np.linalg.solve(rest[:3, :3], rest[:3, robot.dof_index - 3])


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("model", type=pathlib.Path, help="with rows of roll and yaw (train --body all)")
    path = parser.parse_args().model
    model = json.loads(path.read_text(encoding="utf-8"))
    if model.get("robot") != "go1":
        raise SystemExit(f"{path}: the recordings and the simulated robot are of a Go1, the model is not")
    jumps = [read_jump(path) for path in sorted((ROOT / "examples/recordings/go1").glob("train_*.csv.gz"))]
    flights = np.concatenate([jump.x[~jump.feet.any(axis=1)] for jump in jumps])
    posture = flights.mean(axis=0)
    posture[12:15], posture[15:] = (0.0, 0.0, 1.0), 0.0
    simulated = of_mass_matrix(RobotModel("go1"), posture)
    names = model["state"]["names"]
    print("row   source       " + "".join(f"{name:>8}" for name in JOINTS if name[1] == "r"))
    for axis, turn in ((0, "roll"), (2, "yaw")):
        column = names.index(f"body.{turn}")
        row = max(model["encoder"]["weights"], key=lambda weights: abs(weights[column]))
        if row[column] == 0.0:
            raise SystemExit(f"{path}: no latent coordinate has body.{turn}; train it with --body all")
        for source, of in (("learned", lambda j: row[names.index(j)] / row[column]),
                           ("mass matrix", lambda j: simulated[axis, JOINTS.index(j)])):
            print(f"{turn:<6}{source:<13}" + "".join(f"{of(name):>8.3f}" for name in JOINTS if name[1] == "r"))


if __name__ == "__main__":
    main()
