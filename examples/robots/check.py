"""Runs every command on simulated jumps of the robots in this folder, from inspect to generated
controllers that are built and run."""

import argparse
import json
import pathlib
import re
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
# Motors of ANYmal are weaker for its mass than those of a Go1.
EFFORT = {"solo12.toml": 1.0, "anymal_c.toml": 0.65, "hare.urdf": 0.9}
LATENT_DIM = 6
# Torques in contact: of the latent maps alone, and of a controller without the recorded inputs.
LEAST_LIFT_R2, LEAST_TORQUE_R2 = 0.85, 0.5
# Torques of generated code against romc's, N m.
TORQUE_NM = 1e-6


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--romc", type=pathlib.Path, default="romc")
    parser.add_argument("--out-dir", type=pathlib.Path, required=True)
    parser.add_argument("--jumps", type=int, default=8, help="eight or more: a plan needs six to learn from")
    parser.add_argument("--robots", nargs="+", default=list(EFFORT))
    parser.add_argument(
        "--crates", nargs="*", default=["solo12.toml"], help="robots whose controller's crate is built, by cargo"
    )
    arguments = parser.parse_args()
    for name in arguments.robots:
        Check(arguments, name).run()


class Check:
    """All commands on one robot; each prints a line."""

    def __init__(self, arguments, name):
        self.name, self.robot = name, HERE / name
        self.romc, self.builds_crate = str(arguments.romc.resolve()), name in arguments.crates
        self.folder = (arguments.out_dir / self.robot.stem).resolve()
        self.count = arguments.jumps
        self.stem = self.robot.stem
        self.model = self.folder / f"{self.stem}.json"

    def run(self):
        self.jumps = self.recorded()
        self.recordings()
        self.training()
        self.following()
        plan = self.planning()
        self.code(plan)

    def recorded(self):
        """Simulated jumps: the last is for tests, the one before for validation."""
        folder = self.folder / "jumps"
        jumps = [folder / f"jump_{k:02}.csv.gz" for k in range(1, self.count + 1)]
        if not all(jump.exists() for jump in jumps):
            command = [sys.executable, HERE / "jumps.py", self.robot, "--out-dir", folder, "--romc", self.romc]
            output(command + ["--jumps", self.count, "--effort", EFFORT[self.name]])
        return jumps

    def recordings(self):
        legs = [joint["name"] for leg in self.said("robot", self.robot)["robot"]["leg"] for joint in leg["joint"]]
        self.say("robot", f"{len(legs)} joints, {legs[0]} to {legs[-1]}")
        [file] = self.said("inspect", self.jumps[-1], "--robot", self.robot)["files"]
        self.say("inspect", f"{file['samples']} samples, {len(file['segments'])} segment")
        found = self.said("identify", *self.jumps[:-2], "--robot", self.robot)
        self.say("identify", f"gravity {found['gravity_m_s2']:.2f} m/s^2, mass {found['mass_kg']:.2f} kg")
        self.require(abs(found["gravity_m_s2"] - 9.81) < 0.1, "gravity is not that of the simulation")
        converted = self.folder / "jump.mcap"
        self.said("convert", self.jumps[-1], "--output", converted, "--force")
        [again] = self.said("inspect", converted, "--robot", self.robot)["files"]
        self.require(again["samples"] == file["samples"], "MCAP has another number of samples")

    def training(self):
        trained = self.said(
            "train", *self.jumps[:-2], "--validation", self.jumps[-2], "--robot", self.robot,
            "--latent-dim", LATENT_DIM, "--output", self.model, "--force",
        )  # fmt: skip
        self.say("train", f"torque R^2 {trained['report']['training']['torque_r2']:.3f}")
        carried = json.loads(self.model.read_text())["robot"]
        self.require(carried["name"] == self.said("robot", self.robot)["robot"]["name"], "the model has another robot")
        self.said("inspect", self.model)
        study = ["study", *self.jumps[:-2], "--validation", self.jumps[-2], "--robot", self.robot]
        self.said(*study, "--latent-dims", "2..3", "--seeds", 1, "--out-dir", self.folder / "study", "--force")

    def following(self):
        rollouts = self.said("simulate", self.model, self.jumps[-1])["rollouts"]["restarted"]["coordinates"]
        self.say("simulate", f"error of the height {1e3 * rollouts['body.z']['rms']:.1f} mm over 0.1 s")
        self.said("report", self.model, self.jumps[-1], "--output", self.folder / "report.html", "--force")
        [run] = self.said("mpc", self.model, self.jumps[-1], "--lift", "consistent")["runs"]
        told, lift = run["torque_r2"]["contact"], run["lift"]["torque_r2"]["contact"]
        self.say(
            "mpc", f"{run['solved']} of {run['steps']} steps solved, torque R^2 in contact {told:.3f}, "
            f"of the maps alone {lift:.3f}, limit violations {run['limit_violations']}"
        )  # fmt: skip
        self.require(lift >= LEAST_LIFT_R2 and told >= LEAST_TORQUE_R2, "torques are not those of its own jump")
        self.require(run["limit_violations"] == 0, "torques beyond the motors")

    def planning(self):
        """A jump between those that were simulated, as a recording."""
        plan = self.folder / "plan.csv"
        reached = json.loads(self.model.read_text())["landmarks"]["jumps"]
        distance, apex = (sum(jump[k] for jump in reached) / len(reached) for k in (0, 1))
        goal = ["--distance", f"{distance:.4f}", "--apex", f"{apex:.4f}"]
        planned = self.said("plan", self.model, *goal, "--output", plan, "--force")
        self.say("plan", f"{distance:.3f} m ahead, {apex:.3f} m up: {planned['status']}")
        [run] = self.said("mpc", self.model, plan)["runs"]
        self.require(run["failed"] == 0, "the controller does not follow the plan")
        return plan

    def code(self, plan):
        """Emits everything; compiles and runs the model's C, the controller in C, and one controller's crate."""
        out = self.folder / "out"
        targets = "latex,c,rust,python,casadi,matlab,controller,controller-c"
        self.said("compile", self.model, "--emit", targets, "--plan", plan, "--out-dir", out, "--force")
        stem = next(path.name.removesuffix("_selftest.c") for path in out.glob("*_selftest.c"))
        self.say("self-test", last_line(compiled(out, [f"{stem}.c", f"{stem}_selftest.c"])))
        folder = out / f"{stem}-controller-c"
        tested = last_line(compiled(folder, [f"{stem}_controller.c", f"{stem}.c", f"{stem}_controller_selftest.c"]))
        self.say("controller-c", tested)
        off = float(re.search(r"within ([\d.e+-]+) N m", tested)[1])
        self.require(off < TORQUE_NM, "the controller in C has other torques than romc")
        # The example fails unless every step has a plan within all limits.
        jumped = compiled(folder, [f"{stem}_controller.c", f"{stem}.c", f"{stem}_example.c"])
        steps = [line for line in jumped.splitlines() if re.match(r" *\d+\.\d\d ", line)]
        self.say("controller-c", f"its example jumps the plan, to {steps[-1].split()[0]} s")
        if self.builds_crate:
            crate = out / f"{stem}-controller"
            output(["cargo", "build", "--release", "--quiet", "--manifest-path", crate / "Cargo.toml"])
            said = output([sys.executable, crate / "python" / "example.py"])
            self.say("controller", f"the crate's Python example: {last_line(said)}")

    def said(self, *command):
        return json.loads(output([self.romc, *command, "--json"]))

    def say(self, command, text):
        print(f"{self.name}: {command}: {text}", flush=True)

    def require(self, holds, otherwise):
        if not holds:
            raise SystemExit(f"{self.name}: {otherwise}")


def compiled(folder, sources):
    """Builds a C program in a folder, runs it, returns its output."""
    program = folder / "program"
    output(["cc", "-O2", "-ffp-contract=off", "-Wall", "-Werror", "-o", program]
           + [folder / source for source in sources] + ["-lm"])  # fmt: skip
    printed = output([program])
    program.unlink()
    return printed


def last_line(text):
    return text.strip().splitlines()[-1]


def output(command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


if __name__ == "__main__":
    main()
