#!/usr/bin/env python3
"""Prints the ranges of the consistency metrics of `romc inspect` over the recordings of each folder.

    examples/recordings/ranges.py [--romc target/release/romc]                      the folders of this one
    examples/recordings/ranges.py [--romc target/release/romc] --robot a1 FILE ...  other recordings, as one row
"""
import argparse
import json
import pathlib
import subprocess

HERE = pathlib.Path(__file__).resolve().parent
FOLDERS = ["go1", "go1-other", "go1-noisy", "go1-trot", "go1-trot-other", "go1-gaits", "go2-asynchronous"]


def of(figures):
    hips = [share for share in figures["hip_share"] if share is not None]
    better = figures["relative_foot_slip_m"] / figures["other_reading_m"]
    yield "foot slip, mm", [1e3 * figures["foot_slip_m"]], 1
    yield "between feet, mm", [1e3 * figures["relative_foot_slip_m"]], 1
    yield "over the best other reading", [better], 2
    yield "fall, m/s^2", [figures["fall_m_s2"]] if figures["fall_m_s2"] else [], 1
    yield "weight", [figures["weight_share"]], 2
    yield "hips", hips, 2
    yield "acceleration, m/s^2", [abs(figures["acceleration_offset_m_s2"])], 2


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--romc", default="romc")
    parser.add_argument("--robot", help="robot of the recordings FILE ...")
    parser.add_argument("files", nargs="*", metavar="FILE")
    arguments = parser.parse_args()
    if bool(arguments.files) != bool(arguments.robot):
        parser.error("--robot and recordings belong together")
    of_folders = [(name, name[:3], sorted(map(str, (HERE / name).glob("*.csv.gz")))) for name in FOLDERS]
    title = f"{arguments.robot} from {len(arguments.files)} recordings"
    for folder, robot, paths in [(title, arguments.robot, arguments.files)] if arguments.files else of_folders:
        command = [arguments.romc, "inspect", "--json", "--robot", robot, *paths]
        answer = subprocess.run(command, capture_output=True, text=True)
        if answer.returncode != 0:
            raise SystemExit(answer.stderr)
        files = json.loads(answer.stdout)["files"]
        ranges = {}
        for file in files:
            for name, values, digits in of(file["figures"]):
                ranges.setdefault((name, digits), []).extend(values)
        print(folder)
        for (name, digits), values in ranges.items():
            print(f"{name}: {min(values):.{digits}f} to {max(values):.{digits}f}" if values else f"{name}: -")
        print()


if __name__ == "__main__":
    main()
