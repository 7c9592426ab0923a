"""Records simulated walks of a quadruped as CSV, for training and testing reduced-order models."""

import sys

from gait_assessment import assess_walk, walk_table
from gait_sets import GAIT_SETS, STANDING_S, drawn_walk, stems_of
from record_jumps import chosen_set, refuse_foreign_files
from recording_format import COARSE, write_recording
from robot_model import RobotModel
from simulation import Simulation

DURATION_S = 2.4
MOST_DRAWS = 20
EXAMPLE = """example:
  python record_gaits.py --set go1-trot
writes ../recordings/go1-trot/train_01.csv.gz and so on and prints a table of the walks.
The same command writes the same bytes."""


def record(robot, walk):
    """Simulates one walk; returns the log of its recording."""
    plan = walk.plan
    simulation = Simulation(robot)
    yaw = walk.start_yaw()
    simulation.reset(robot.standing_joints(plan.height_m), plan.height_m, (0.0, 0.0, yaw))
    controller = walk.range.controller(robot, plan, STANDING_S, walk.seed)
    start_s = STANDING_S + walk.recorded_s
    end_s = start_s + DURATION_S
    return simulation.run(controller, end_s).between(start_s, end_s)


def main():
    gait_set, folder, force = chosen_set(GAIT_SETS, "walks", __doc__, EXAMPLE)
    ours = {f"{stem}.csv.gz" for stem in stems_of(gait_set)}
    refuse_foreign_files(folder, ours, force)
    folder.mkdir(parents=True, exist_ok=True)
    print(walk_table(write_gait_set(gait_set, folder)))


def write_gait_set(gait_set, folder):
    """Records every walk of the set; returns (Walk, GaitAssessment) pairs."""
    return [write_walk(gait_set, index, folder) for index in range(len(stems_of(gait_set)))]


def write_walk(gait_set, index, folder):
    """Records one walk, drawn until one is not refused."""
    for refused in range(MOST_DRAWS):
        walk = drawn_walk(gait_set, index, refused)
        robot = RobotModel(gait_set.robot, walk.floor)
        log = record(robot, walk)
        columns = (log.time_s, log.x, log.dx, log.torque_nm, log.feet())
        whole = assess_walk(robot, walk, *columns)
        faults = whole.faults(walk, gait_set.tracks)
        if log.other_contact.any():
            faults.append("something other than the feet touches the floor")
        if not faults:
            write_recording(folder / f"{walk.stem}.csv.gz", *columns, COARSE)
            return walk, whole
        print(f"{walk.stem}: refused: {'; '.join(faults)}", file=sys.stderr)
    raise SystemExit(f"{walk.stem}: {MOST_DRAWS} draws are refused")


if __name__ == "__main__":
    main()
