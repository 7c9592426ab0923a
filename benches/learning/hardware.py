"""Refines models on recordings of real robots and prints the tables of docs/evaluation/hardware.md.

    cargo build --release && python3 benches/learning/hardware.py FOLDER

FOLDER holds `go1_hardware_jump.csv`, `go1_hardware_flights.csv.gz` and `a1/a1_01.csv.gz` to `a1_24.csv.gz`, which are not
part of romc (docs/evaluation/hardware.md names their sources). No model is judged on the recordings that refined it. One
to two minutes; needs Python alone.
"""

import argparse
import bisect
import csv
import json
import math
import pathlib
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
MODEL = ROOT / "models" / "go1-d7.json"
LEGS = [f"{leg}.{joint}" for leg in ("fr", "fl", "rr", "rl") for joint in ("hy", "kn")]
SHOWN = ["body.x", "body.z", "body.pitch", *LEGS]
LEAST_STD_RAD = 0.03
A1_REFINED = [("01", "02"), ("03", "04"), ("05", "06"), ("07", "15"), ("17", "18")]
A1_TRAINING = ["01", "02", "03", "04", "05", "06", "07", "15", "17", "18"]
A1_JUDGED = ["19", "20", "21", "24"]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--romc", type=pathlib.Path, default=ROOT / "target" / "release" / "romc")
    parser.add_argument("--only", choices=["jump", "flights", "a1"])
    arguments = parser.parse_args()
    data = arguments.folder.resolve()
    parts = {"jump": jump, "flights": flights, "a1": other_robot}
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(arguments.romc.resolve(), pathlib.Path(folder))
        for name, part in parts.items():
            if arguments.only in (None, name):
                part(bench, data)


class Bench:
    def __init__(self, romc, folder):
        self.romc, self.folder = romc, folder

    def run(self, *command):
        command = [str(part) for part in (self.romc, *command)]
        return subprocess.run(command, cwd=ROOT, capture_output=True, text=True)

    def repaired(self, recording, model, name):
        """The rows of a recording as romc repairs them, and the notes that it prints."""
        path = self.folder / f"{name}.csv"
        done = self.run("convert", recording, "--clock", "repaired", "--inputs-of", model, "--output", path, "--force")
        if done.returncode != 0:
            raise SystemExit(done.stderr)
        rows = list(csv.reader(path.open(), delimiter=";"))
        return rows, [line for line in done.stderr.splitlines() if line]

    def written(self, header, rows, name):
        path = self.folder / f"{name}.csv"
        with path.open("w", newline="") as file:
            csv.writer(file, delimiter=";").writerows([header, *rows])
        return path

    def refined(self, recordings, name, *flags):
        """The refined model; none if romc refuses."""
        path = self.folder / f"{name}.json"
        done = self.run("train", "--from", MODEL, *recordings, *flags, "--output", path, "--force")
        return (path if done.returncode == 0 else None), done.stdout + done.stderr

    def trajectories(self, model, recording, restart_s):
        """Columns of `romc simulate --output`, with the constant velocities of the recording."""
        path = self.folder / "trajectories.csv"
        command = ["simulate", model, recording, "--clock", "recorded"]
        self.run(*command, "--restart-every", restart_s, "--output", path, "--force")
        with path.open() as file:
            rows = list(csv.DictReader(file))
        numbers = lambda name: [float(row[name]) if row[name] else math.nan for row in rows]
        return {name: numbers(name) for name in rows[0] if name != "phase"}


def number(text):
    return float(text.replace(",", "."))


def column(rows, name):
    index = rows[0].index(name)
    return [number(row[index]) for row in rows[1:]]


def place_and_rate(name):
    if not name.startswith("body"):
        return f"{name} Position", f"{name} Velocity"
    axis = {"roll": "x", "pitch": "y", "yaw": "z"}
    part = name.split(".")[1]
    kind = "angular" if part in axis else "linear"
    return tuple(f"Body {kind} {what} {axis.get(part, part)}" for what in ("Position", "Velocity"))


def rms(errors):
    return math.sqrt(sum(error * error for error in errors) / len(errors))


def windows(time_s, interval_s):
    start = 0
    while start < len(time_s):
        end = max(start + 1, bisect.bisect_left(time_s, time_s[start] + interval_s - 5e-7))
        yield start, end
        start = end


def errors(bench, model, rows, recording, restart_s):
    """Root mean squares of model, constant velocity, rest and the decoded state, and each deviation; SI."""
    found, time_s = {}, column(rows, "Time")
    predicted = bench.trajectories(model, recording, restart_s)
    decoded = reconstruction(model, predicted)
    for name in SHOWN:
        place, rate = (column(rows, of) for of in place_and_rate(name))
        of = {"model": [], "velocity": [], "rest": []}
        recorded = predicted[name]  # in the axes of the prediction
        of["decoded"] = [a - b for a, b in zip(decoded[name], recorded)]
        for start, end in windows(time_s, restart_s):
            for i in range(start, end):
                of["model"].append(predicted[f"{name}_restarted"][i] - recorded[i])
                of["velocity"].append(place[start] + rate[start] * (time_s[i] - time_s[start]) - place[i])
                of["rest"].append(place[start] - place[i])
        mean = sum(place) / len(place)
        found[name] = {key: rms(values) for key, values in of.items()}
        found[name]["std"] = rms([value - mean for value in place])
    return found


def reconstruction(model, trajectories):
    """Reconstruction of the recorded states by encoder and decoder, without any dynamics."""
    file = json.loads(pathlib.Path(model).read_text())
    z = [trajectories[f"z_{k + 1}"] for k in range(file["latent_dim"])]
    found = {}
    for name, weights, bias in zip(file["state"]["names"], file["decoder"]["weights"], file["decoder"]["bias"]):
        sums = ((bias + sum(w * value for w, value in zip(weights, column))) for column in zip(*z))
        found[name] = [value / file["scaling"]["state"] for value in sums]
    return found


def jump(bench, data):
    rows, notes = bench.repaired(data / "go1_hardware_jump.csv", MODEL, "jump")
    print("## The jump of a real Go1\n")
    print("\n".join(notes), "\n")
    header, samples = rows[0], rows[1:]
    feet = [header.index(f"{leg} Foot") for leg in ("fr", "fl", "rr", "rl")]
    flies = [all(number(row[foot]) == 0.0 for foot in feet) for row in samples]
    touchdown = max(i for i, flight in enumerate(flies) if flight) + 1
    parts = {"crouch to flight": samples[:touchdown], "landing": samples[touchdown:]}
    files = {
        name: bench.written(header, part, f"part{number}") for number, (name, part) in enumerate(parts.items())
    }
    for refined_on, judged_on in (list(parts), list(parts)[::-1]):
        model, said = bench.refined([files[refined_on]], "refined", "--clock", "recorded")
        print(f"### Refined on {refined_on}, judged on {judged_on}\n")
        print("\n".join(line for line in said.splitlines() if line.startswith(("multiplied", "unchanged", "error"))), "\n")
        judged = [header, *parts[judged_on]]
        print("| after | model | " + " | ".join(SHOWN) + " |\n" + "|---" * (len(SHOWN) + 2) + "|")
        for restart_s in (0.05, 0.1):
            kinds = [("as shipped", MODEL)] + ([("refined", model)] if model else [])
            for kind, of in kinds:
                found = errors(bench, of, judged, files[judged_on], restart_s)
                print(f"| {restart_s} s | {kind} | " + " | ".join(worse(found[name]) for name in SHOWN) + " |")
            for kind in ("velocity", "rest", "decoded"):
                print(f"| {restart_s} s | {kind} | " + " | ".join(f"{1e3 * found[name][kind]:.1f}" for name in SHOWN) + " |")
        small = [name for name in LEGS if found[name]["std"] <= LEAST_STD_RAD]
        print(f"\nstandard deviation up to {LEAST_STD_RAD} rad: {', '.join(small) or 'none'}\n")
        done = bench.run("mpc", model or MODEL, files[judged_on], "--clock", "recorded")
        print("mpc:", verdict(done), "\n")


def worse(found):
    """An error, bold if a constant velocity has a smaller one."""
    text = f"{1e3 * found['model']:.1f}"
    return f"**{text}**" if found["model"] > found["velocity"] else text


def verdict(done):
    lines = [line for line in (done.stdout + done.stderr).splitlines() if "FAILED" in line or "verdict" in line or "rror" in line]
    return "; ".join(lines[:6])


def flights(bench, data):
    rows, notes = bench.repaired(data / "go1_hardware_flights.csv.gz", MODEL, "flights")
    print("## Fourteen flights of a real Go1\n")
    print("\n".join(notes), "\n")
    time_s = column(rows, "Time")
    starts = [0] + [i for i in range(1, len(time_s)) if time_s[i] <= time_s[i - 1]] + [len(time_s)]
    pieces = [rows[1:][a:b] for a, b in zip(starts, starts[1:])]
    files = [bench.written(rows[0], piece, f"flight{i}") for i, piece in enumerate(pieces)]
    print("| flight | s | pitch turns by | as shipped | refined on the others | constant velocity | rest |\n" + "|---" * 7 + "|")
    total, better = [], 0
    for i, (piece, path) in enumerate(zip(pieces, files)):
        others = [file for file in files if file != path]
        model, _ = bench.refined(others, "refined", "--clock", "recorded")
        own = [rows[0], *piece]
        pitch, rate = (column(own, of) for of in place_and_rate("body.pitch"))
        duration_s = column(own, "Time")[-1] - column(own, "Time")[0]
        last = lambda model: bench.trajectories(model, path, 0.1)["body.pitch_full"][-1] - pitch[-1]
        found = [last(MODEL), last(model or MODEL), pitch[0] + rate[0] * duration_s - pitch[-1], pitch[0] - pitch[-1]]
        total.append(found)
        better += abs(found[1]) < min(abs(found[2]), abs(found[3]))
        cells = " | ".join(f"{1e3 * abs(error):.0f}" for error in found)
        print(f"| {i + 1} | {duration_s:.3f} | {1e3 * (pitch[-1] - pitch[0]):.0f} | {cells} |")
    cells = " | ".join(f"{1e3 * rms(errors):.0f}" for errors in zip(*total))
    print(f"| root mean square | | | {cells} |\n\nbetter than constant velocity and rest in {better} of {len(pieces)} flights\n")


def other_robot(bench, data):
    print("## From a Go1 to a real A1\n")
    path = lambda number: data / "a1" / f"a1_{number}.csv.gz"
    ten = bench.folder / "ten.json"
    training = [path(number) for number in A1_TRAINING]
    done = bench.run("train", *training, "--robot", "a1", "--latent-dim", 7, "--output", ten, "--force")
    if done.returncode != 0 and not ten.exists():
        raise SystemExit(done.stderr)
    judged = []
    for jump_number in A1_JUDGED:
        rows, _ = bench.repaired(path(jump_number), ten, "a1")
        feet = [rows[0].index(f"{leg} Foot") for leg in ("fr", "fl", "rr", "rl")]
        flies = [all(number(row[foot]) == 0.0 for foot in feet) for row in rows[1:]]
        runs = [(i, j) for i, j in stretches(flies) if flies[i] and j - i > 100]
        start, end = max(runs, key=lambda run: run[1] - run[0])
        piece = [rows[0], *rows[1:][start : min(end + 1, len(flies))]]
        judged.append((piece, bench.written(piece[0], piece[1:], f"a1flight{jump_number}")))
    print("| model | z after 0.1 s, mm | pitch after 0.1 s, mrad | pitch at touchdown, two flights "
          "| pitch at the end of four flights |\n" + "|---" * 5 + "|")
    print("| constant velocity | " + " | ".join(a1_figures(bench, ten, path, judged, "constant_velocity")) + " |")
    print("| trained on ten jumps | " + " | ".join(a1_figures(bench, ten, path, judged, "rms")) + " |")
    for pair in A1_REFINED:
        model, said = bench.refined([path(number) for number in pair], "two", "--robot", "a1")
        if model is None:
            print(f"| refined on {' and '.join(pair)} | refused |  |  |  |", said[-200:])
            continue
        print(f"| go1-d7 refined on {' and '.join(pair)} | " + " | ".join(a1_figures(bench, model, path, judged, "rms")) + " |")


def a1_figures(bench, model, path, judged, key):
    done = bench.run("simulate", model, *(path(number) for number in A1_JUDGED), "--verbose", "--json")
    horizons = {of["name"]: of["coordinates"] for of in json.loads(done.stdout)["horizons"]}
    after, touchdown = horizons["0.1 s"], horizons["take-off to touchdown"]
    ends = []
    for rows, file in judged:
        pitch, rate = (column(rows, of) for of in place_and_rate("body.pitch"))
        time_s = column(rows, "Time")
        if key == "rms":
            end = bench.trajectories(model, file, 0.1)["body.pitch_full"][-1]
        else:
            end = pitch[0] + rate[0] * (time_s[-1] - time_s[0])
        ends.append(end - pitch[-1])
    shown = [after["body.z"][key], after["body.pitch"][key], touchdown["body.pitch"][key]]
    return [f"{1e3 * value:.1f}" if i == 0 else f"{1e3 * value:.0f}" for i, value in enumerate([*shown, rms(ends)])]


def stretches(flags):
    start = 0
    for i in range(1, len(flags) + 1):
        if i == len(flags) or flags[i] != flags[start]:
            yield start, i
            start = i


if __name__ == "__main__":
    main()
