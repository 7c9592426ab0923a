"""Walks a simulated Go1 by commands of speed and yaw rate that change every two seconds, as from a joystick.

The state machine in C stands up, walks by the strides of its model, follows the commands, stops and
stands. No trajectory is planned before.
"""

import argparse
import pathlib
import sys
from dataclasses import dataclass

import mujoco
import numpy as np
from PIL import Image, ImageDraw

import c_controller
import walk_loop
from followers import Commanded
from parallel import results_of
from perturbations import NOMINAL, Motors, perturbed_simulation
from robot_model import Floor, RobotModel
from simulation import CONTROL_STEP_S, Push, write_state
from walk_plans import RANGES, miss, velocity_of

EXAMPLE = """example:
  cargo build --release
  MUJOCO_GL=egl python walk_commands.py --seed 1
draws 6 sequences of 6 commands (0.2 to 0.9 m/s, up to 0.5 rad/s) and drives each with and without
perturbations."""
STRIDE_S = 0.36
CROUCH, CROUCH_M = np.array([0.0, 0.9, -1.8] * 4), 0.28
LATEST_S = 5.0  # to stand up, and to stand again
MOST_TILT_RAD = 0.35
# The robot starts from the floor: there is no recording from which its start could differ.
PERTURBATIONS = tuple(one for one in walk_loop.PERTURBATIONS if one.start_offset_rad == 0.0)
FOLLOWERS = {"MPC": False, "no dynamics": True}
# Least share of the runs of the MPC without a fall, and most median error in the last stride of a command.
LEAST_SHARE, MOST_ERROR = 1.0, 0.15
FRAME, FRAME_S = (240, 432), 0.1
CROSSES, CROSSES_M = 3, 0.5


@dataclass(frozen=True)
class Run:
    """A run: of each command the reached speed (m/s) and yaw rate (rad/s); whether it stood up, walked and stood again
    without a fall."""

    follower: str
    perturbation: str
    commanded: tuple
    reached: tuple
    success: bool
    largest_tilt_rad: float

    def errors(self):
        """Error of each command, as a share of it (of 0.2 where it is less)."""
        return map(miss, self.commanded, self.reached)


class Operator(Commanded):
    """Requests of an operator to the state machine: stand up, walk, other commands, stop."""

    def __init__(self, machine, commands, hold_s):
        super().__init__(machine, walk_loop.RATE_HZ)
        self.commands, self.hold_s, self.start_s, self.stopped = commands, hold_s, None, False
        self.has_stood = False

    def step(self, time_s, x, dx, feet):
        machine = self.controller
        mode = machine.mode()
        if mode == "damp" and not self.has_stood:
            self.has_stood = machine.stand(time_s, x)
        if mode == "ready" and self.start_s is None and machine.walk(*self.at(0)):
            self.start_s = time_s
        if mode == "walk":
            number = int((time_s - self.start_s) / self.hold_s)
            if number < len(self.commands):
                machine.walk(*self.at(number))
            else:
                self.stopped = machine.stop() or self.stopped
        super().step(time_s, x, dx, feet)

    def at(self, number):
        speed, yaw_rate = self.commands[number]
        return speed, 0.0, yaw_rate


def main():
    arguments = parse_arguments()
    arguments.out_dir.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(arguments.seed)
    sequences = [
        tuple(tuple(random.uniform(*span) for span in RANGES.values()) for _ in range(arguments.commands))
        for _ in range(arguments.sequences)
    ]
    crates = walk_loop.built(arguments)[:2]
    if arguments.film:
        write_film(arguments.film, crates, sequences[0], arguments.hold)
    tasks = [
        (follower, crates, perturbation, commands, arguments.hold)
        for follower in arguments.followers
        for perturbation in PERTURBATIONS
        if perturbation.short in arguments.perturbations
        for commands in sequences
    ]
    runs = results_of(run, tasks, arguments.jobs)
    print(table(runs))
    own = [one for one in runs if one.follower == "MPC"]
    error = np.median([error for one in own for error in one.errors()]) if own else 0.0
    if sum(one.success for one in own) < LEAST_SHARE * len(own) or error > MOST_ERROR:
        print(f"MISSED MPC: all runs without a fall, median error {MOST_ERROR:.0%}", file=sys.stderr)
        sys.exit(1)


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    root = walk_loop.ROOT
    parser.add_argument("--model", type=pathlib.Path, default=root / "models/go1-trot-d6.json")
    parser.add_argument("--romc", type=pathlib.Path, default=walk_loop.ROMC, help="the compiler")
    parser.add_argument("--out-dir", type=pathlib.Path, default=root / "out/walk_commands")
    parser.add_argument("--seed", type=int, default=1, help="of the commands")
    parser.add_argument("--sequences", type=int, default=6, help="sequences to draw")
    parser.add_argument("--commands", type=int, default=6, help="commands of a sequence")
    parser.add_argument("--hold", type=float, default=2.0, help="time of a command, s (default: 2)")
    parser.add_argument("--followers", choices=FOLLOWERS, nargs="+", default=list(FOLLOWERS))
    shorts = [perturbation.short for perturbation in PERTURBATIONS]
    parser.add_argument("--perturbations", choices=shorts, nargs="+", default=shorts)
    parser.add_argument("--film", type=pathlib.Path, help="moving picture of the first run (.webp)")
    parser.add_argument("--jobs", type=int, help="runs at a time (default: one per core)")
    return parser.parse_args()


def run(task):
    """One run."""
    return driven(*task)[2]


def driven(follower, crates, perturbation, commands, hold_s):
    """Log, operator and Run of a sequence of commands."""
    start = np.concatenate([CROUCH, [0.0, 0.0, CROUCH_M], np.zeros(3)])
    simulation = perturbed_simulation("go1", perturbation, Floor(), start, np.zeros(18), 1.0)
    if perturbation.short == "push":
        middle_s = 2.0 + 0.5 * hold_s * len(commands)
        simulation.push = Push(middle_s, middle_s + walk_loop.PUSH_S, (0.0, walk_loop.PUSH_N, 0.0))
    module = c_controller.load(crates[1 if FOLLOWERS[follower] else 0])
    operator = Operator(module.Machine(), commands, hold_s)
    motors = Motors(operator, perturbation, simulation.robot.torque_limit_nm)
    log = simulation.run(motors, 2.0 * LATEST_S + hold_s * len(commands))
    tilt_rad = float(np.abs(log.x[:, 15:17]).max())
    stands = operator.stopped and operator.controller.mode() == "ready"
    success = stands and not log.other_contact.any() and tilt_rad < MOST_TILT_RAD
    reached = tuple(reached_at(log, operator, number) for number in range(len(commands)))
    shown = Run(follower, perturbation.short, commands, reached, success, tilt_rad)
    return log, operator, shown


def reached_at(log, operator, number):
    """Speed along the heading and yaw rate over the last stride of a command; zero if it never began."""
    if operator.start_s is None:
        return 0.0, 0.0
    end_s = operator.start_s + operator.hold_s * (number + 1)
    rows = (log.time_s >= end_s - STRIDE_S) & (log.time_s <= end_s)
    if rows.sum() < 2:
        return 0.0, 0.0
    return velocity_of(log.x[rows])


def table(runs):
    """Markdown: of each follower and perturbation runs without a fall and the median error of the commands."""
    shorts = list(dict.fromkeys(one.perturbation for one in runs))
    lines = [["follower", *shorts, "all"], ["---"] * (len(shorts) + 2)]
    for follower in dict.fromkeys(one.follower for one in runs):
        own = [one for one in runs if one.follower == follower]
        cells = [follower]
        for short in shorts:
            of = [one for one in own if one.perturbation == short]
            median = np.median([error for one in of for error in one.errors()])
            cells.append(f"{sum(one.success for one in of)}; {100 * median:.1f} %")
        cells.append(f"{sum(one.success for one in own)} of {len(own)}")
        lines.append(cells)
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def write_film(path, crates, commands, hold_s):
    """Moving picture of a run: a camera that moves with the robot, the command and the velocity."""
    log, operator, _ = driven("MPC", crates, NOMINAL, commands, hold_s)
    robot = RobotModel("go1")
    data, camera = mujoco.MjData(robot.mj), mujoco.MjvCamera()
    camera.elevation, camera.distance, camera.azimuth = -20, 1.2, 60
    pictures = []
    every = round(FRAME_S / CONTROL_STEP_S)
    end_s = operator.start_s + hold_s * len(commands) + 2.0
    with mujoco.Renderer(robot.mj, *FRAME) as renderer:
        for row in range(0, int(end_s / CONTROL_STEP_S), every):
            write_state(robot, data, log.x[row])
            mujoco.mj_forward(robot.mj, data)
            camera.lookat[:] = (log.x[row, 12], log.x[row, 13], 0.2)
            renderer.update_scene(data, camera)
            draw_floor(renderer.scene, log.x[row, 12:14])
            picture = Image.fromarray(renderer.render())
            ImageDraw.Draw(picture).text((10, 8), caption(log, operator, row), fill="white", font_size=13)
            pictures.append(picture)
    options = {"save_all": True, "duration": round(1e3 * FRAME_S), "loop": 0, "quality": 45}
    pictures[0].save(path, append_images=pictures[1:], **options)


def draw_floor(scene, place):
    """Crosses of 0.5 m on the floor around a place: without them a motion cannot be seen."""
    first = np.floor(np.asarray(place) / CROSSES_M) * CROSSES_M
    for number in range((2 * CROSSES + 1) ** 2):
        cell = np.array(divmod(number, 2 * CROSSES + 1)) - CROSSES
        for arm in (np.array([0.06, 0.008, 0.001]), np.array([0.008, 0.06, 0.001])):
            at = np.array([*(first + CROSSES_M * cell), 0.001])
            geom = scene.geoms[scene.ngeom]
            kind, colour = mujoco.mjtGeom.mjGEOM_BOX, np.array([0.95, 0.75, 0.2, 1.0])
            mujoco.mjv_initGeom(geom, kind, arm, at, np.eye(3).ravel(), colour)
            scene.ngeom += 1


def caption(log, operator, row):
    """The command at a row, and the mean velocity of the robot over the stride before it."""
    time_s = log.time_s[row]
    passed_s = time_s - operator.start_s
    number = int(passed_s // operator.hold_s)
    before = max(row - round(STRIDE_S / CONTROL_STEP_S), 0)
    speed, rate = velocity_of(log.x[before : row + 1]) if row > before else (0.0, 0.0)
    if passed_s < 0.0:
        asked = "stand up"
    elif number >= len(operator.commands):
        asked = "stop"
    else:
        asked = "{:.2f} m/s, {:+.2f} rad/s".format(*operator.commands[number])
    return f"{time_s:4.1f} s   asked: {asked}   robot: {speed:.2f} m/s, {rate:+.2f} rad/s"


if __name__ == "__main__":
    main()
