"""A plan compared with a recording: learns the shorter jumps of a folder, plans a longer one.

    python plan_beside_recording.py FOLDER --robot a1 --jump a1_07.csv.gz --shorter-than 0.4 \\
        --phases jump-rear

FOLDER contains recordings that romc reads without a map; their clocks are repaired first. The plan gets
only the start, the distance and the rise of the recorded jump. Prints root mean square differences of
body path, joint angles and torques on the ground to the recorded jump. It does so for the plan and for
two baselines: the training jump nearest to the goal and the mean of all. Draws the three with the jump
(`--figure`).
"""

import argparse
import csv
import gzip
import json
import pathlib
import subprocess

import numpy as np

LEGS, JOINTS = ("fr", "fl", "rr", "rl"), ("hx", "hy", "kn")
NAMES = [f"{leg}.{joint}" for leg in LEGS for joint in JOINTS]
ROOT = pathlib.Path(__file__).resolve().parents[2]


class Jump:
    """Times, body path, pitch, joint angles and torques of a recording, up to its touch-down."""

    def __init__(self, path):
        opened = gzip.open if path.suffix == ".gz" else open
        with opened(path, "rt", encoding="ascii") as file:
            text = file.read()
        delimiter = ";" if ";" in text.partition("\n")[0] else ","
        rows = list(csv.reader(text.splitlines(), delimiter=delimiter))
        values = np.array([[float(cell.replace(",", ".")) for cell in row] for row in rows[1:]])
        columns = dict(zip(rows[0], values.T, strict=True))

        def stack(names):
            return np.stack([columns[name] for name in names], axis=1)

        feet = stack([f"{leg} Foot" for leg in LEGS]) > 0.5
        in_air = np.flatnonzero(~feet.any(axis=1))
        if in_air.size == 0:
            raise SystemExit(f"{path}: no sample without a foot on the ground")
        end = in_air[-1] + 1
        self.name, self.take_off = path.name, in_air[0]
        self.time_s = columns["Time"][:end] - columns["Time"][0]
        path_names = [f"Body linear Position {axis}" for axis in "xz"]
        self.path = stack(path_names)[:end]
        self.pitch = columns["Body angular Position y"][:end]
        self.joints = stack([f"{name} Position" for name in NAMES])[:end]
        self.torque = stack([f"{name} Torque" for name in NAMES])[:end]
        self.path[:, 0] -= self.path[0, 0]

    @property
    def goal(self):
        """Distance and rise, m."""
        return self.path[-1, 0], self.path[:, 1].max() - self.path[0, 1]

    def at(self, time_s, values):
        """Values of this jump at other times."""
        columns = values.reshape(len(values), -1).T
        return np.stack([np.interp(time_s, self.time_s, column) for column in columns], axis=1)


def romc(arguments, *words):
    command = [str(arguments.romc), *map(str, words)]
    finished = subprocess.run(command, capture_output=True, text=True, check=False)
    if finished.returncode != 0:
        raise SystemExit(f"{' '.join(command)}\n{finished.stderr}")
    return finished.stdout


def planned(arguments, jump, training):
    """The model of the training jumps, and its plan of the jump's goal."""
    out = arguments.out_dir
    files = [out / "jumps" / other.name for other in training]
    words = [
        "--robot",
        arguments.robot,
        "--phases",
        arguments.phases,
        "--latent-dim",
        arguments.latent_dim,
        "--actuators",
        arguments.actuators,
        "--wrench-frame",
        arguments.wrench_frame,
    ]
    romc(arguments, "train", *files, *words, "--output", out / "model.json", "--force")
    distance, apex = jump.goal
    words = [
        "--distance",
        f"{distance:.4f}",
        "--apex",
        f"{apex:.4f}",
        "--start",
        out / "jumps" / jump.name,
    ]
    text = romc(
        arguments,
        "plan",
        out / "model.json",
        *words,
        "--output",
        out / "plan.csv",
        "--force",
        "--json",
    )
    return Jump(out / "plan.csv"), json.loads(text)


def differences(jump, other):
    """Root mean square differences on the jump's own times: m, m, rad, rad, N m."""
    time_s = jump.time_s[jump.time_s <= other.time_s[-1]]
    ground = time_s[time_s < jump.time_s[jump.take_off]]

    def rms(of, times=time_s):
        return float(np.sqrt(np.mean((jump.at(times, of(jump)) - other.at(times, of(other))) ** 2)))

    return [
        rms(lambda j: j.path[:, 0]),
        rms(lambda j: j.path[:, 1]),
        rms(lambda j: j.pitch),
        rms(lambda j: j.joints),
        rms(lambda j: j.torque[:, THIGHS_AND_KNEES], ground),
    ]


# Hips hold the legs upright and are not specific to the jump.
THIGHS_AND_KNEES = [k for k, name in enumerate(NAMES) if not name.endswith("hx")]


def mean_of(training):
    """The mean of jumps at equal times, as long as the shortest of them."""
    mean = Jump.__new__(Jump)
    mean.name = "mean of all"
    shortest = min(training, key=lambda jump: jump.time_s[-1])
    mean.time_s, mean.take_off = shortest.time_s, shortest.take_off
    for key in ("path", "pitch", "joints", "torque"):
        values = np.mean([jump.at(mean.time_s, getattr(jump, key)) for jump in training], axis=0)
        setattr(mean, key, values)
    return mean


def draw(path, jump, rows):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    colours = ("#111111", "#c2410c", "#2563eb", "#94a3b8")
    figure, axes = plt.subplots(2, 3, figsize=(11, 6), layout="constrained")
    lines = [("recorded", jump), *rows]
    knee, thigh = NAMES.index("rr.kn"), NAMES.index("rr.hy")
    panels = [
        ("body path", lambda j: (j.path[:, 0], j.path[:, 1]), "x, m", "z, m"),
        ("pitch", lambda j: (j.time_s, j.pitch), "time, s", "rad"),
        ("rear right thigh", lambda j: (j.time_s, j.joints[:, thigh]), "time, s", "rad"),
        ("rear right knee", lambda j: (j.time_s, j.joints[:, knee]), "time, s", "rad"),
        (
            "its torque until take-off",
            lambda j: (j.time_s[: j.take_off], j.torque[: j.take_off, knee]),
            "time, s",
            "N m",
        ),
        (
            "front right knee torque",
            lambda j: (j.time_s[: j.take_off], j.torque[: j.take_off, 2]),
            "time, s",
            "N m",
        ),
    ]
    for axis, (title, of, x, y) in zip(axes.flat, panels, strict=True):
        for (name, line), colour in zip(lines, colours):
            width = 2.4 if name in ("recorded", "plan") else 1.1
            axis.plot(*of(line), color=colour, linewidth=width, label=name)
        axis.set_title(title, fontsize=10)
        axis.set_xlabel(x)
        axis.set_ylabel(y)
        axis.grid(alpha=0.25)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(lines), fontsize=9)
    figure.savefig(path, dpi=110)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--jump", required=True, help="file name of the jump to plan")
    parser.add_argument("--robot", required=True)
    parser.add_argument("--phases", default="contact-flight")
    parser.add_argument("--latent-dim", type=int, default=6)
    parser.add_argument("--actuators", default="identify", help="as of romc train")
    parser.add_argument("--wrench-frame", default="ground", help="as of romc train")
    parser.add_argument(
        "--shorter-than", type=float, default=np.inf, help="distance of training jumps, m"
    )
    parser.add_argument("--romc", type=pathlib.Path, default=ROOT / "target/release/romc")
    parser.add_argument(
        "--out-dir", type=pathlib.Path, default=pathlib.Path("out/plan_beside_recording")
    )
    parser.add_argument("--figure", type=pathlib.Path)
    arguments = parser.parse_args()
    jumps = []
    (arguments.out_dir / "jumps").mkdir(parents=True, exist_ok=True)
    for path in sorted(arguments.folder.glob("*.csv*")):
        mended = arguments.out_dir / "jumps" / path.name
        romc(arguments, "convert", path, "--clock", "repaired", "--output", mended, "--force")
        jumps.append(Jump(mended))
    jump = next((jump for jump in jumps if jump.name == arguments.jump), None)
    if jump is None:
        raise SystemExit(f"{arguments.folder}: no {arguments.jump} in it")
    training = [
        other for other in jumps if other.goal[0] < arguments.shorter_than and other is not jump
    ]
    if not training:
        raise SystemExit(f"{arguments.folder}: no jump shorter than {arguments.shorter_than} m")
    plan, found = planned(arguments, jump, training)
    goal = np.array(jump.goal)
    nearest = min(training, key=lambda other: np.linalg.norm(np.array(other.goal) - goal))
    rows = [
        ("plan", plan),
        (f"nearest, {nearest.name}", nearest),
        ("mean of all", mean_of(training)),
    ]
    print(
        f"{jump.name}: {goal[0]:.3f} m, apex {goal[1]:.3f} m; {len(training)} training jumps of",
        end=" ",
    )
    print(f"{min(t.goal[0] for t in training):.3f} to {max(t.goal[0] for t in training):.3f} m")
    print(
        f"planned: {found['distance_m']:.3f} m, apex {found['apex_m']:.3f} m; {'; '.join(found['reasons']) or 'trusted'}"
    )
    print(f"{'':<24}{'x m':>8}{'z m':>8}{'pitch rad':>11}{'joints rad':>12}{'torque N m':>12}")
    for name, other in rows:
        x, z, pitch, joints, torque = differences(jump, other)
        print(f"{name:<24}{x:>8.3f}{z:>8.3f}{pitch:>11.3f}{joints:>12.3f}{torque:>12.2f}")
    if arguments.figure:
        draw(arguments.figure, jump, rows)


if __name__ == "__main__":
    main()
