"""Draws the motion of a recording as a strip of pictures."""

import argparse
import pathlib

import mujoco
import numpy as np
from PIL import Image

from recording_format import read_recording, states_of
from robot_model import TORQUE_LIMIT_NM, RobotModel
from simulation import write_state

EXAMPLE = """example (without a display, set MUJOCO_GL=egl or osmesa):
  MUJOCO_GL=egl python film_strip.py ../recordings/go1/test_01.csv.gz --output strip.png"""
FRAME = (300, 400)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recording", type=pathlib.Path, help="a .csv.gz of record_jumps.py")
    parser.add_argument("--output", type=pathlib.Path, required=True, help="a .png to write")
    parser.add_argument("--robot", choices=TORQUE_LIMIT_NM, default="go1")
    parser.add_argument("--frames", type=int, default=12)
    arguments = parser.parse_args()
    if not arguments.recording.is_file():
        parser.error(f"no such file: {arguments.recording}")

    x = states_of(read_recording(arguments.recording))[0]
    rows = np.linspace(0, len(x) - 1, arguments.frames).astype(int)
    pictures = render(RobotModel(arguments.robot), x[rows])
    half = (len(pictures) + 1) // 2
    pictures += [np.full_like(pictures[0], 255)] * (2 * half - len(pictures))
    strip = np.vstack([np.hstack(pictures[:half]), np.hstack(pictures[half:])])
    Image.fromarray(strip).save(arguments.output)


def render(robot, states):
    """One picture (height, width, 3) per state (18,), seen from the right, camera at rest."""
    data = mujoco.MjData(robot.mj)
    camera = mujoco.MjvCamera()
    # From so far above that the floor, not the black sky, is behind the robot.
    camera.azimuth, camera.elevation, camera.distance = 90, -22, 1.35
    robot.mj.vis.headlight.ambient[:] = robot.mj.vis.headlight.diffuse[:] = 0.5
    camera.lookat[:] = (states[:, 12].mean(), 0.0, 0.22)
    pictures = []
    with mujoco.Renderer(robot.mj, *FRAME) as renderer:
        for x in states:
            write_state(robot, data, x)
            mujoco.mj_forward(robot.mj, data)
            renderer.update_scene(data, camera)
            pictures.append(renderer.render().copy())
    return pictures


if __name__ == "__main__":
    main()
