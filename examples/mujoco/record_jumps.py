"""Records simulated quadruped jumps as CSV, for training and testing reduced-order models."""

import argparse
import dataclasses
import pathlib
import sys

from assessment import assess, longest_flight, table
from jump_sets import SETS, WARMUP_S, jumps_of
from recording_format import write_recording
from robot_model import RobotModel
from simulation import Simulation

LONGEST_S = 1.6
MIN_FLIGHT_S = 0.2
RECORDINGS = pathlib.Path(__file__).resolve().parent.parent / "recordings"
EXAMPLE = """example:
  python record_jumps.py --set go1
writes ../recordings/go1/train_01.csv.gz and so on and prints a table of the jumps.
The same command writes the same bytes."""


def record(jump_set, jump):
    """Simulates one jump; returns its log from the moment the robot stands still.

    The robot first stands for `WARMUP_S`, unrecorded, so that its feet have
    settled; the log ends when the landing motion has come to rest.
    """
    robot = RobotModel(jump_set.robot, jump.floor)
    plan = jump.plan
    simulation = Simulation(robot, jump_set.noise, jump.seed, jump.push)
    joints = robot.standing_joints(plan.stand_height_m) + jump.start_offset_rad
    simulation.reset(joints, plan.stand_height_m)
    controller = jump_set.controller(robot, plan, start_s=WARMUP_S)
    log = simulation.run(controller, WARMUP_S + LONGEST_S)
    return log.between(WARMUP_S, controller.rest_s(WARMUP_S + LONGEST_S))


def main():
    jump_set, folder, force = chosen_set(SETS, "jumps", __doc__, EXAMPLE)
    ours = {f"{jump.stem}.csv.gz" for jump in jumps_of(jump_set)}
    refuse_foreign_files(folder, ours, force)
    folder.mkdir(parents=True, exist_ok=True)
    print(table(write_set(jump_set, folder)))


def write_set(jump_set, folder):
    """Records every jump of the set; returns (stem, Assessment) pairs, landings included."""
    rows = []
    for jump in jumps_of(jump_set):
        path = folder / f"{jump.stem}.csv.gz"
        log = record(jump_set, jump)
        whole = assess(jump_set.robot, log.time_s, log.x, log.dx, log.torque_nm, log.feet())
        refuse_failed_jump(path.name, whole, log)
        if jump_set.to_touchdown:
            log = log.before(longest_flight(log.feet())[1])
        write_recording(path, log.time_s, log.x, log.dx, log.torque_nm, log.feet())
        rows.append((jump.stem, whole))
        print(f"{path.name}: {whole.summary()}", file=sys.stderr)
    return rows


def refuse_failed_jump(name, whole, log):
    """Stops unless the robot jumped, landed on its feet and stands."""
    faults = whole.faults(MIN_FLIGHT_S)
    if log.other_contact.any():
        at_s = log.time_s[log.other_contact][0]
        faults.append(f"something other than the feet touched the floor at {at_s:.3f} s")
    if faults:
        raise SystemExit(f"{name}: {'; '.join(faults)}")


def chosen_set(sets, motions, description, example):
    """The set that the command line asks for, the folder to write, and whether files of others may be there."""
    parser = argparse.ArgumentParser(
        description=description, epilog=example, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--set", required=True, choices=sets, help="which data set to record")
    parser.add_argument(
        "--out-dir", type=pathlib.Path, help="folder to write (default: ../recordings/SET)"
    )
    parser.add_argument("--seed", type=int, help=f"draw other {motions} of the set (needs --out-dir)")
    parser.add_argument(
        "--force", action="store_true", help="write even into a folder that holds other files"
    )
    arguments = parser.parse_args()
    chosen, folder = sets[arguments.set], arguments.out_dir or RECORDINGS / arguments.set
    if arguments.seed is not None:
        if arguments.out_dir is None:
            raise SystemExit(f"--seed draws other {motions} than the repository has: give an --out-dir")
        chosen = dataclasses.replace(chosen, seed=arguments.seed)
    return chosen, folder, arguments.force


def refuse_foreign_files(folder, ours, force):
    """Stops if the folder holds anything this set does not write."""
    if force or not folder.exists():
        return
    if not folder.is_dir():
        raise SystemExit(f"{folder} is not a folder")
    foreign = sorted(p.name for p in folder.iterdir() if p.name not in ours | {"README.md"})
    if foreign:
        raise SystemExit(
            f"{folder} holds files of another origin ({', '.join(foreign[:3])}); "
            "choose another --out-dir or give --force"
        )


if __name__ == "__main__":
    main()
