"""Takes simulated jumps of the robots in this folder through every command, from inspect to the
controller."""

import argparse
import json
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
# Motors of ANYmal are weaker for its mass than those of a Go1.
EFFORT = {"solo12.toml": 1.0, "anymal_c.toml": 0.65, "hare.urdf": 0.9}
LEAST_TORQUE_R2 = 0.7


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--romc", type=pathlib.Path, default="romc")
    parser.add_argument("--out-dir", type=pathlib.Path, required=True)
    parser.add_argument("--jumps", type=int, default=8)
    parser.add_argument("--robots", nargs="+", default=list(EFFORT))
    parser.add_argument("--build", action="store_true", help="also build the generated controller")
    arguments = parser.parse_args()
    for name in arguments.robots:
        check(arguments, name)


def check(arguments, name):
    romc = str(arguments.romc)
    robot = HERE / name
    folder = arguments.out_dir / robot.stem
    jumps = [folder / "jumps" / f"jump_{k:02}.csv.gz" for k in range(1, arguments.jumps + 1)]
    if not all(jump.exists() for jump in jumps):
        run(
            [sys.executable, HERE / "jumps.py", robot, "--out-dir", folder / "jumps"]
            + ["--romc", romc, "--jumps", arguments.jumps, "--effort", EFFORT[name]]
        )
    train, validation, test = jumps[:-2], jumps[-2:-1], jumps[-1:]
    model = folder / f"{robot.stem}-d4.json"
    inspected = said(romc, "inspect", *test, "--robot", robot)
    print(f"{name}: inspect: {inspected['files'][0].get('findings', inspected['files'][0].keys())}"[:300])
    found = said(romc, "identify", *train, "--robot", robot)
    print(f"{name}: identify: gravity {found['gravity_m_s2']:.2f} m/s^2, mass {found['mass_kg']:.2f} kg")
    trained = said(
        romc, "train", *train, "--validation", *validation, "--robot", robot, "--latent-dim", 4,
        "--output", model, "--force",
    )  # fmt: skip
    print(f"{name}: train: torque R^2 {trained['report']['training']['torque_r2']:.3f}")
    said(romc, "inspect", model)
    said(romc, "simulate", model, *test)
    said(romc, "report", model, *test, "--output", folder / "report.html", "--force")
    followed = said(romc, "mpc", model, *test, "--lift", "consistent")
    run_ = followed["runs"][0]
    print(
        f"{name}: mpc: {run_['solved']} of {run_['steps']} steps solved, torque R^2 in contact "
        f"{run_['torque_r2']['contact']:.3f}, limit violations {run_['limit_violations']}"
    )
    if run_["torque_r2"]["contact"] < LEAST_TORQUE_R2 or run_["limit_violations"]:
        raise SystemExit(f"{name}: the controller does not follow its own jump")
    emitted = said(
        romc, "compile", model, "--emit", "latex,c,rust,python,controller",
        "--out-dir", folder / "out", "--force",
    )  # fmt: skip
    stem = emitted_stem(folder / "out")
    run(["cc", "-O2", "-o", folder / "selftest", folder / "out" / f"{stem}.c",
         folder / "out" / f"{stem}_selftest.c", "-lm"])  # fmt: skip
    print(f"{name}: self-test: {run([folder / 'selftest']).splitlines()[-1]}")
    if arguments.build:
        crate = folder / "out" / f"{stem}-controller"
        run(["cargo", "build", "--release", "--manifest-path", crate / "Cargo.toml"])
        print(f"{name}: controller: {run([sys.executable, crate / 'python' / 'example.py'])[-200:]}")


def emitted_stem(folder):
    return next(path.stem.removesuffix("_selftest") for path in folder.glob("*_selftest.c"))


def run(command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


def said(*command):
    return json.loads(run([*command, "--json"]))


if __name__ == "__main__":
    main()
