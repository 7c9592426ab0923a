"""Drives a simulated Go1 along recorded trots with the latent controller in C, under perturbations."""

import argparse
import functools
import json
import pathlib
import sys
from dataclasses import asdict, dataclass, replace

import numpy as np

import c_controller
from followers import Commanded, Jump, Replay
from gait_sets import GAIT_SETS, walks_of
from model_inputs import ModelInputs
from parallel import results_of
from path_axes import Path
from perturbations import NOMINAL, Motors, Perturbation, perturbed_simulation
from recording_format import read_recording, states_of
from robot_model import Floor, RobotModel
from simulation import CONTROL_STEP_S, Push
from uninformed import write_uninformed

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
RECORDINGS = ROOT / "examples/recordings"
ROMC = ROOT / "target/release/romc"
ROBOT = "go1"
RATE_HZ = 500
EXAMPLE = """example:
  cargo build --release
  MUJOCO_GL=egl python walk_loop.py --model ../../models/go1-trot-d6.json
drives the controller along the three test trots and three of another controller."""
# Settings of the controller along a walk, see docs/explanation/walking.md.
SETTINGS = {
    "lift": 1,
    "legs": 1,
    "input_weight": 2.0,
    "terminal_weight": 100.0,
    "velocity_weight": 0.02,
    "place_scale_m": 0.03,
    "heading_scale_rad": 0.05,
}
PUSH_N, PUSH_S = 40.0, 0.1
PERTURBATIONS = (
    NOMINAL,
    Perturbation("payload +2 kg", "+2 kg", payload_kg=2.0),
    Perturbation("torque x0.9", "tau 0.9", torque_factor=0.9),
    Perturbation("push 40 N", "push"),
    Perturbation("friction 0.4", "mu 0.4", friction=0.4),
    Perturbation("start pose 0.04 rad", "start", start_offset_rad=0.04),
)
MOST_TILT_RAD = 0.35
END_SHARE, END_M = 0.15, 0.1
# Least shares of the runs that succeed.
AIMS = {"MPC": 0.94, "MPC, no recorded input": 0.88}


@dataclass(frozen=True)
class Driver:
    """Who drives: a model's controller or its copy without dynamics, with recorded input or not, fed
    with measurements or with the recording; or neither."""

    model: bool = True
    uninformed: bool = False
    recorded_input: bool = True
    feedback: bool = True


FOLLOWERS = {
    "MPC": Driver(),
    "MPC, no recorded input": Driver(recorded_input=False),
    "feedback off": Driver(feedback=False),
    "no dynamics": Driver(uninformed=True),
    "no dynamics, no recorded input": Driver(uninformed=True, recorded_input=False),
    "recorded torques + PD": Driver(model=False),
}


@dataclass
class Outcome:
    """One run, and how it ended: distance (m) from the recorded end, largest roll or pitch (rad)."""

    follower: str
    perturbation: str
    walk: str
    success: bool
    faults: str
    end_error_m: float
    largest_tilt_rad: float
    statuses: dict
    fell: bool = False


def main():
    arguments = parse_arguments()
    arguments.out_dir.mkdir(parents=True, exist_ok=True)
    controllers = built(arguments)
    settings = {**SETTINGS, **dict(arguments.setting)}
    walks = arguments.walks or [
        *sorted((RECORDINGS / "go1-trot").glob("test_*.csv.gz")),
        *sorted((RECORDINGS / "go1-trot-other").glob("trot_*.csv.gz"))[1::2],
    ]
    chosen = [p for p in PERTURBATIONS if p.short in arguments.perturbations]
    tasks = [
        (follower, controllers, tuple(settings.items()), perturbation, walk)
        for follower in arguments.followers
        for perturbation in chosen
        for walk in walks
    ]
    outcomes = results_of(run, tasks, arguments.jobs)
    text = json.dumps([asdict(outcome) for outcome in outcomes], indent=1)
    (arguments.out_dir / "walk_loop.json").write_text(text + "\n", encoding="utf-8")
    print(text if arguments.json else table(outcomes, chosen, len(walks)))
    missed = [follower for follower, share in AIMS.items() if success_share(outcomes, follower) < share]
    for follower in missed:
        print(f"MISSED {follower}: {AIMS[follower]:.0%} of the runs", file=sys.stderr)
    sys.exit(1 if missed else 0)


def success_share(outcomes, follower):
    """Share of a follower's runs that succeed; 1 without any."""
    own = [outcome.success for outcome in outcomes if outcome.follower == follower]
    return float(np.mean(own)) if own else 1.0


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--model", type=pathlib.Path, default=ROOT / "models/go1-trot-d6.json")
    parser.add_argument("--romc", type=pathlib.Path, default=ROMC, help="the compiler")
    parser.add_argument("--out-dir", type=pathlib.Path, default=ROOT / "out/walk_loop")
    parser.add_argument("--walks", type=pathlib.Path, nargs="+", help="recordings to follow")
    parser.add_argument(
        "--followers", choices=FOLLOWERS, nargs="+", default=list(FOLLOWERS), metavar="NAME"
    )
    shorts = [perturbation.short for perturbation in PERTURBATIONS]
    parser.add_argument("--perturbations", choices=shorts, nargs="+", default=shorts)
    parser.add_argument(
        "--setting", type=named_number, action="append", default=[], metavar="NAME=NUMBER"
    )
    parser.add_argument("--json", action="store_true", help="print the outcomes, not the table")
    parser.add_argument("--jobs", type=int, help="runs at a time (default: one per core)")
    return parser.parse_args()


def named_number(text):
    """("name", number) of NAME=NUMBER."""
    name, _, number = text.partition("=")
    return name, float(number)


def built(arguments):
    """(crate, uninformed crate, rule of inputs) of the model."""
    folder = arguments.out_dir.resolve() / "controllers"
    model, romc = arguments.model.resolve(), arguments.romc.resolve()
    copy = folder / f"{model.stem}-uninformed.json"
    inputs = ModelInputs.compiled(model, folder / f"{model.stem}-inputs", romc)
    training = sorted((RECORDINGS / "go1-trot").glob("train_*.csv.gz"))
    write_uninformed(model, copy, training, inputs.of)
    crates = [c_controller.build(path, folder / path.stem, romc) for path in (model, copy)]
    return (*crates, inputs)


@functools.cache
def read_walk(path):
    """A recorded walk, with the floor that it was recorded on."""
    columns = read_recording(path)
    x, dx, _, torque_nm, feet = states_of(columns)
    name, folder = path.name.removesuffix(".csv.gz"), path.parent.name
    known = walks_of(GAIT_SETS[folder]) if folder in GAIT_SETS else []
    floor = next((walk.floor for walk in known if walk.stem == name), Floor())
    return Jump(name, columns["Time"], x, dx, torque_nm, feet, folder, floor)


class OnPath(Commanded):
    """The controller along the unrolled walk: measurements in the axes of its path."""

    def __init__(self, controller, walk, path, feedback):
        super().__init__(controller, RATE_HZ)
        self.walk, self.path, self.feedback = walk, path, feedback

    def step(self, time_s, x, dx, feet):
        if not self.feedback:
            row = self.walk.row_at(time_s)
            x, dx, feet = self.walk.x[row], self.walk.dx[row], self.walk.feet[row]
        super().step(time_s, *self.path.measured(time_s, x, dx), feet)


def run(task):
    """One closed-loop run; returns its Outcome."""
    return driven(task)[1]


def driven(task):
    """One closed-loop run; returns its log and its Outcome."""
    name, (crate, uninformed_crate, inputs), settings, perturbation, recording = task
    driver, walk = FOLLOWERS[name], read_walk(recording)
    start = (walk.x[0], walk.dx[0])
    simulation = perturbed_simulation(ROBOT, perturbation, walk.floor, *start, 1.0)
    if perturbation.short == "push":
        across = walk.x[len(walk.x) // 2, 17] + 0.5 * np.pi
        force = (PUSH_N * np.cos(across), PUSH_N * np.sin(across), 0.0)
        simulation.push = Push(1.0, 1.0 + PUSH_S, force)
    follower, controller = Replay(walk, with_torques=True), None
    follower.feed_forward_in_flight = True
    if driver.model:
        module = c_controller.load(uninformed_crate if driver.uninformed else crate)
        controller = module.Controller(with_settings(module.Library().default_settings(), settings))
        path = Path(walk.time_s, walk.x)
        x, dx = path.unrolled(walk.x, walk.dx)
        u = inputs.of(replace(walk, x=x, dx=dx)) if driver.recorded_input else None
        controller.set_reference(walk.time_s, x, dx, u, walk.feet)
        follower = OnPath(controller, walk, path, driver.feedback)
    motors = Motors(follower, perturbation, simulation.robot.torque_limit_nm)
    log = simulation.run(motors, walk.time_s[-1])
    outcome = judged(name, perturbation, walk, log)
    outcome.statuses = {str(s): n for s, n in getattr(follower, "statuses", {}).items()}
    if controller:
        controller.close()
    return log, outcome


def with_settings(chosen, settings):
    for name, number in settings:
        setattr(chosen, name, type(getattr(chosen, name))(number))
    return chosen


def judged(name, perturbation, walk, log):
    """Whether only feet touched the floor, the robot stayed upright and ended where it should."""
    tilt_rad = float(np.abs(log.x[:, 15:17]).max())
    rows = min(len(log.x), len(walk.x))
    end_error_m = float(np.hypot(*(log.x[rows - 1, 12:14] - walk.x[rows - 1, 12:14])))
    way_m = float(np.hypot(*np.diff(walk.x[:, 12:14], axis=0).T).sum())
    faults = []
    if log.other_contact.any():
        faults.append("something other than the feet touches the floor")
    if tilt_rad > MOST_TILT_RAD:
        faults.append(f"roll or pitch reaches {tilt_rad:.2f} rad")
    fell = bool(faults)
    if end_error_m > max(END_SHARE * way_m, END_M):
        faults.append(f"ends {end_error_m:.2f} m off")
    walk_name = f"{walk.folder}/{walk.name}"
    text = "; ".join(faults)
    return Outcome(
        name, perturbation.name, walk_name, not faults, text, end_error_m, tilt_rad, {}, fell
    )


def table(outcomes, perturbations, walks):
    """Successes and median distance from the recorded end (m) of each follower, by perturbation."""
    head = ["follower", *(p.short for p in perturbations), "all"]
    lines = [" | ".join(head), " | ".join(["---"] * len(head))]
    for follower in dict.fromkeys(outcome.follower for outcome in outcomes):
        own = [outcome for outcome in outcomes if outcome.follower == follower]
        cells = [follower]
        for perturbation in perturbations:
            of = [outcome for outcome in own if outcome.perturbation == perturbation.name]
            median = np.median([outcome.end_error_m for outcome in of])
            cells.append(f"{sum(outcome.success for outcome in of)}; {median:.3f}")
        cells.append(f"{sum(outcome.success for outcome in own)} of {walks * len(perturbations)}")
        lines.append(" | ".join(cells))
    return "\n".join(f"| {line} |" for line in lines)


if __name__ == "__main__":
    main()
