"""Checks the checked-in recordings and the leg kinematics they rest on; exits 1 on any fault."""

import argparse
import pathlib
import sys
import tempfile

import numpy as np

from assessment import assess, longest_flight, table
from gait_assessment import assess_walk, step_faults, walk_table
from gait_sets import GAIT_SETS, walks_of
from jump_sets import SETS, jumps_of
from kinematics_check import kinematics_report
from record_gaits import DURATION_S as WALK_S
from record_gaits import write_gait_set
from record_jumps import MIN_FLIGHT_S, RECORDINGS, write_set
from recording_format import read_recording, states_of
from robot_model import RobotModel
from set_comparison import comparison
from simulation import CONTROL_STEP_S

EXAMPLE = """example:
  python check_recordings.py              figures and checks of ../recordings
  python check_recordings.py --reproduce  also records all sets again and compares bytes"""
MAX_TOTAL_BYTES = 12_500_000
DURATION_S = (0.8, 1.6)
# Two sets of one robot; the README of the second lists their differences.
COMPARED = ("go1", "go1-other")
REAR_LEAD_S = (0.15, 0.23)
MIN_HEIGHT_M = 0.15


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--recordings", type=pathlib.Path, default=RECORDINGS)
    parser.add_argument("--reproduce", action="store_true", help="record again, compare bytes")
    arguments = parser.parse_args()

    faults = []
    for name, one_set in [*SETS.items(), *GAIT_SETS.items()]:
        folder = arguments.recordings / name
        if name in SETS:
            found, rows = check_set(folder, one_set)
            text = table(rows)
        else:
            found, rows = check_gait_set(folder, one_set)
            text = walk_table(rows)
        faults += found
        readme = folder / "README.md"
        if not readme.exists() or text not in readme.read_text(encoding="utf-8"):
            faults.append(f"{name}/README.md does not hold the table of its recordings")
        print(f"\n{name} ({one_set.robot}, seed {one_set.seed})\n\n{text}")
    if not any(fault.endswith("is missing") for fault in faults):
        text = comparison(arguments.recordings, {name: SETS[name] for name in COMPARED})
        readme = arguments.recordings / COMPARED[-1] / "README.md"
        if not readme.exists() or text not in readme.read_text(encoding="utf-8"):
            faults.append(f"{COMPARED[-1]}/README.md does not hold how its jumps differ")
        print(f"\n{text}")
    for robot in sorted({jump_set.robot for jump_set in SETS.values()}):
        found, report = kinematics_report(RobotModel(robot))
        faults += found
        print(f"\n{report}")
    size = sum(path.stat().st_size for path in arguments.recordings.rglob("*.csv.gz"))
    print(f"\nall recordings: {size / 1e6:.2f} MB")
    if size > MAX_TOTAL_BYTES:
        faults.append(f"recordings have {size} bytes, more than {MAX_TOTAL_BYTES}")
    if arguments.reproduce:
        faults += compare_with_new(arguments.recordings)

    for fault in faults:
        print(f"FAULT {fault}", file=sys.stderr)
    print(f"{len(faults)} faults")
    sys.exit(1 if faults else 0)


def check_set(folder, jump_set):
    """(faults, table rows) of one folder of jumps."""
    robot = RobotModel(jump_set.robot)
    rows = []
    faults, jumps = present_of(folder, jumps_of(jump_set))
    for jump, path in jumps:
        columns = read_recording(path)
        states = states_of(columns)
        found = recording_faults(columns["Time"], states, robot, jump_set)
        faults += [f"{folder.name}/{path.name}: {fault}" for fault in found]
        x, dx, _, torque, feet = states
        rows.append((jump.stem, assess(jump_set.robot, columns["Time"], x, dx, torque, feet)))
    return faults, rows


def check_gait_set(folder, gait_set):
    """(faults, table rows) of one folder of walks."""
    rows = []
    faults, walks = present_of(folder, walks_of(gait_set))
    for walk, path in walks:
        robot = RobotModel(gait_set.robot, walk.floor)
        columns = read_recording(path)
        time_s = columns["Time"]
        x, dx, ddx, torque, feet = states_of(columns)
        whole = assess_walk(robot, walk, time_s, x, dx, torque, feet)
        found = format_faults(time_s, x, dx, ddx) + joint_limit_faults(x, robot, 0.0)
        found += step_faults(robot, x, dx, torque) + whole.faults(walk, gait_set.tracks)
        if abs(whole.duration_s - WALK_S) > 1e-9:
            found.append(f"lasts {whole.duration_s:.3f} s")
        faults += [f"{folder.name}/{path.name}: {fault}" for fault in found]
        rows.append((walk, whole))
    return faults, rows


def present_of(folder, recordings):
    """Faults for files that are missing or of no set; (recording, path) of those present."""
    paths = {recording.stem: folder / f"{recording.stem}.csv.gz" for recording in recordings}
    expected = {path.name for path in paths.values()}
    present = {path.name for path in folder.glob("*.csv.gz")}
    faults = [f"{folder.name}/{name} is missing" for name in sorted(expected - present)]
    faults += [f"{folder.name}/{name} is of no set" for name in sorted(present - expected)]
    return faults, [(r, paths[r.stem]) for r in recordings if paths[r.stem].name in present]


def recording_faults(time_s, states, robot, jump_set):
    """Faults of one recording."""
    x, dx, ddx, torque, feet = states
    whole = assess(robot.name, time_s, x, dx, torque, feet)
    faults = format_faults(time_s, x, dx, ddx)
    if jump_set.to_touchdown:
        faults += [f for f in whole.faults(MIN_FLIGHT_S) if not f.startswith("the trunk")]
    else:
        faults += whole.faults(MIN_FLIGHT_S)
    faults += phase_faults(feet, jump_set.to_touchdown)
    if not DURATION_S[0] <= whole.duration_s <= DURATION_S[1]:
        faults.append(f"lasts {whole.duration_s:.3f} s")
    near, far = jump_set.distance_m
    if not jump_set.to_touchdown and not near <= whole.distance_m <= far:
        faults.append(f"goes {whole.distance_m:.3f} m far, not {near} to {far} m")
    shortest, longest = jump_set.flight_s
    if not shortest <= whole.flight_s <= longest:
        faults.append(f"flies {whole.flight_s:.3f} s, not {shortest} to {longest} s")
    if whole.lowest_height_m < MIN_HEIGHT_M:
        faults.append(f"the trunk sinks to {whole.lowest_height_m:.3f} m")
    faults += joint_limit_faults(x, robot, 5 * jump_set.noise.joint_rad if jump_set.noise else 0.0)
    if jump_set.noise is None:
        # The physics step is a quarter of the recording's, so the mean rate is not quite the
        # trapezium's; rounding of positions adds 1e-6 m / 2 ms.
        drift = np.abs(np.diff(x, axis=0) / CONTROL_STEP_S - 0.5 * (dx[1:] + dx[:-1]))
        if (drift > 0.3 * np.abs(np.diff(dx, axis=0)) + 0.05).any():
            faults.append("velocities are not the rates of the positions")
    return faults


def joint_limit_faults(x, robot, slack_rad):
    low, high = robot.joint_limit_rad.T
    outside = (x[:, :12] < low - slack_rad).any() or (x[:, :12] > high + slack_rad).any()
    return ["a joint leaves its limits"] if outside else []


def format_faults(time_s, x, dx, ddx):
    faults = []
    if not np.isfinite(np.hstack([x, dx, ddx])).all():
        faults.append("holds a value that is not finite")
    if np.abs(time_s - CONTROL_STEP_S * np.arange(len(time_s))).max() > 1e-9:
        faults.append("time does not start at 0 in steps of 2 ms")
    if np.abs(x[0, 12:14]).max() > 0.0:
        faults.append("body x and y do not start at 0")
    if np.abs(np.diff(dx, axis=0) / CONTROL_STEP_S - ddx[:-1]).max() > 2e-3:
        faults.append("accelerations are not the differences of the velocities")
    return faults


def phase_faults(feet, to_touchdown):
    """The order of contacts: all feet, (rear feet alone,) none, and all feet again at the end."""
    faults = []
    count = feet.sum(axis=1)
    if count[0] != 4:
        faults.append("does not start on four feet")
    first, last = longest_flight(feet)
    if to_touchdown and last != len(feet):
        faults.append("does not end in flight")
    if not to_touchdown and count[-1] != 4:
        faults.append("does not end on four feet")
    rear_alone = (~feet[:first, :2].any(axis=1) & feet[:first, 2:].all(axis=1)).sum()
    lead_s = rear_alone * CONTROL_STEP_S
    if to_touchdown and not REAR_LEAD_S[0] <= lead_s <= REAR_LEAD_S[1]:
        faults.append(f"the rear feet stand alone for {lead_s:.3f} s")
    if not to_touchdown and (count[:first] < 4).sum() * CONTROL_STEP_S > 0.05:
        faults.append("the feet do not leave together")
    return faults


def compare_with_new(recordings):
    """Faults for files that the recorder does not make again byte for byte."""
    faults = []
    with tempfile.TemporaryDirectory() as temporary:
        for name, one_set in [*SETS.items(), *GAIT_SETS.items()]:
            folder = pathlib.Path(temporary) / name
            folder.mkdir()
            write = write_set if name in SETS else write_gait_set
            write(one_set, folder)
            for path in sorted(folder.iterdir()):
                old = recordings / name / path.name
                if not old.exists() or old.read_bytes() != path.read_bytes():
                    faults.append(f"{name}/{path.name} does not come out the same again")
    return faults


if __name__ == "__main__":
    main()
