#!/usr/bin/env python3
"""Prints the ranges of the consistency metrics of `romc inspect` over the recordings of each folder.

    examples/recordings/ranges.py [--romc target/release/romc]
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
    romc = parser.parse_args().romc
    for folder in FOLDERS:
        paths = sorted(map(str, (HERE / folder).glob("*.csv.gz")))
        command = [romc, "inspect", "--json", "--robot", folder[:3], *paths]
        files = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)["files"]
        ranges = {}
        for file in files:
            for name, values, digits in of(file["figures"]):
                ranges.setdefault((name, digits), []).extend(values)
        print(folder)
        for (name, digits), values in ranges.items():
            print(f"{name}: {min(values):.{digits}f} to {max(values):.{digits}f}" if values else f"{name}: -")


if __name__ == "__main__":
    main()
