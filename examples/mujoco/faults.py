"""Faults of sensors, clock and robot while a simulated Go1 jumps, or trots, by the controller in C.

The supervisor of the controller has to name each fault, and torques have to fade into joint damping.
Torques are those of the command and of the joint PD with the command's gains.
"""

import argparse
import json
import pathlib
import sys

import numpy as np

import c_controller
from closed_loop import ROBOT, ROMC, ROOT, TRAINING, read_jump
from followers import FIRST_SUPERVISED, Commanded
from model_inputs import ModelInputs
from perturbations import NOMINAL, perturbed_simulation
from simulation import Push
from walk_loop import SETTINGS, read_walk, with_settings

EXAMPLE = """example:
  cargo build --release
  python faults.py --rate 500
prints the status that each fault ended in and how long after its first measurement. Exits with 1 if
one is not named in time, if torques leave the damping law, or if a run without fault is stopped."""
IN_TIME_S, FADED_S = 0.12, 0.3
MOST_DAMPING_NM, DAMPING_NM_S = 10.0, 1.0
PUSH_S = 0.1


def exchanged_sides(x, dx, feet):
    order = [3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8, *range(12, 18)]
    return x[order], dx[order], feet[[1, 0, 3, 2]]


def frozen(self, time_s, x, dx, feet):
    self.held = self.held or (x, dx, feet)
    return (time_s, *self.held)


def changed(**changes):
    """A fault that replaces parts of x or dx: names x or dx, values {coordinate: function of the value}."""

    def fault(_, time_s, x, dx, feet):
        x, dx = x.copy(), dx.copy()
        for name, change in changes.items():
            values = {"x": x, "dx": dx}[name]
            for coordinate, of in change.items():
                values[coordinate] = of(values[coordinate])
        return time_s, x, dx, feet

    return fault


ZERO = {i: lambda _: 0.0 for i in (12, 13, 14)}
FAULTS = {
    "none": lambda _, *measured: measured,
    "roll of 3.1 rad": changed(x={15: lambda _: 3.1}),
    "measurement frozen": frozen,
    "body 5 m aside": changed(x={13: lambda y: y + 5}),
    "thigh and calf exchanged": lambda _, t, x, dx, feet: (
        t,
        x[[0, 2, 1, *range(3, 18)]],
        dx[[0, 2, 1, *range(3, 18)]],
        feet,
    ),
    "signs of joints turned": changed(x={i: lambda q: -q for i in range(12)}),
    "encoder 0.6 rad off": changed(x={4: lambda q: q + 0.6}),
    "clock stands": lambda self, t, *others: (self.fault_s, *others),
    "clock runs backwards": lambda self, t, *others: (2 * self.fault_s - t, *others),
    "clock 0.3 s ahead": lambda _, t, *others: (t + 0.3, *others),
    "clock 0.3 s behind": lambda _, t, *others: (t - 0.3, *others),
    "velocity of the base zero": changed(dx=ZERO),
    "contacts inverted": lambda _, t, x, dx, feet: (t, x, dx, ~feet),
    "left and right exchanged": lambda _, t, x, dx, feet: (t, *exchanged_sides(x, dx, feet)),
    "not a number": changed(x={4: lambda _: np.nan}),
    "push of 60 N": lambda _, *measured: measured,
    "push of 200 N": lambda _, *measured: measured,
}
# The body has to move before they show; in a walk the robot has to come to its other feet.
SLOW = ("velocity of the base zero", "push of 200 N")
SLOW_IN_WALKS = (*SLOW, "contacts inverted", "left and right exchanged")
# The robot stays on its feet, at least in some of the runs.
HARMLESS = ("clock 0.3 s ahead", "clock 0.3 s behind", "left and right exchanged", "push of 60 N")


class Faulty(Commanded):
    """The controller with its joint PD. From `fault_s` on its measurements are wrong."""

    def __init__(self, controller, fault, fault_s, rate_hz):
        super().__init__(controller, rate_hz)
        self.fault, self.fault_s = fault, fault_s
        self.held, self.supervised = None, None
        self.off_law_nm = 0.0

    def step(self, time_s, x, dx, feet):
        measured = (time_s, x, dx, feet)
        if time_s > self.fault_s - 1e-6:
            measured = self.fault(self, *measured)
        super().step(*measured)
        if self.command.status >= FIRST_SUPERVISED and self.supervised is None:
            self.supervised = time_s, self.command.status
        if self.supervised and time_s > self.supervised[0] + FADED_S:
            damped = np.zeros(12)
            is_finite = np.isfinite(np.concatenate(measured[1:3])).all()
            if is_finite and self.fault is not frozen:
                damped = np.clip(-DAMPING_NM_S * measured[2][:12], -MOST_DAMPING_NM, MOST_DAMPING_NM)
            off = np.abs(np.array(self.command.torque) - damped).max()
            self.off_law_nm = max(self.off_law_nm, off + self.command.stiffness)


def run(module, inputs, jump, fault, fault_s, rate_hz, walks):
    """Name of the status, delay and contact of the trunk after the fault (s, or none), and the largest
    deviation of torques from the damping law (N m)."""
    chosen = module.Library().default_settings()
    if walks:
        chosen = with_settings(chosen, SETTINGS.items())
    controller = module.Controller(chosen)
    controller.set_reference(jump.time_s, jump.x, jump.dx, inputs.of(jump), jump.feet)
    simulation = perturbed_simulation(ROBOT, NOMINAL, jump.floor, jump.x[0], jump.dx[0], 0.0)
    if fault.startswith("push"):
        simulation.push = Push(fault_s, fault_s + PUSH_S, (0.0, float(fault.split()[2]), 0.0))
    faulty = Faulty(controller, FAULTS[fault], fault_s, rate_hz)
    # A walk ends in the middle of a step.
    log = simulation.run(faulty, jump.time_s[-1] + (0.0 if walks else 0.5))
    touched = np.flatnonzero(log.other_contact & (log.time_s >= fault_s))
    touch_s = log.time_s[touched[0]] - fault_s if len(touched) else None
    if faulty.supervised is None:
        return None, None, touch_s, 0.0
    at_s, status = faulty.supervised
    word = controller.status_text(status).split(":")[0]
    return word, at_s - fault_s, touch_s, faulty.off_law_nm


def main():
    arguments = parse_arguments()
    crate = c_controller.build(arguments.model, arguments.out_dir / arguments.model.stem, arguments.romc)
    inputs = ModelInputs.compiled(arguments.model, arguments.out_dir / f"{arguments.model.stem}-inputs", arguments.romc)
    read = read_walk if arguments.walk else read_jump
    module, jump = c_controller.load(crate), read(arguments.jump)
    rows, missed = [], []
    slow = SLOW_IN_WALKS if arguments.walk else SLOW
    print(f"{'fault':27} {'from s':>6} {'status':18} {'after s':>7} {'touches s':>9} {'off law N m':>11}")
    for fault in FAULTS:
        for fault_s in (0.0, 0.2, 0.36):
            word, after_s, touch_s, law = run(
                module, inputs, jump, fault, fault_s, arguments.rate, arguments.walk
            )
            rows.append(
                {"fault": fault, "from_s": fault_s, "status": word, "after_s": after_s, "touches_s": touch_s}
            )
            numbers = [f"{s:.3f}" if s is not None else "-" for s in (after_s, touch_s)]
            print(f"{fault:27} {fault_s:6.2f} {word or '-':18} {numbers[0]:>7} {numbers[1]:>9} {law:11.2g}")
            if not is_right(fault, word, after_s, touch_s, law, slow):
                missed.append(f"{fault} from {fault_s} s")
    if arguments.json:
        print(json.dumps(rows))
    if missed:
        print("FAILED " + "; ".join(missed))
    sys.exit(1 if missed else 0)


def is_right(fault, word, after_s, touch_s, law, slow):
    """Whether a fault is named before the trunk touches the floor, and torques follow the law."""
    if fault == "none":
        return word is None
    if word is None and fault in HARMLESS:
        return touch_s is None
    in_time = word is not None and (after_s < IN_TIME_S + 1e-9 or fault in slow)
    return in_time and (touch_s is None or after_s < touch_s) and law < 1e-3


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--model", type=pathlib.Path, default=ROOT / "models/go1-d7.json")
    parser.add_argument("--jump", type=pathlib.Path, default=TRAINING / "test_01.csv.gz")
    parser.add_argument(
        "--walk", action="store_true", help="model and recording are of walks: settings of walks"
    )
    parser.add_argument("--rate", type=int, default=100, help="control steps a second (default: 100)")
    parser.add_argument("--romc", type=pathlib.Path, default=ROMC, help="the compiler")
    parser.add_argument("--out-dir", type=pathlib.Path, default=ROOT / "out/faults")
    parser.add_argument("--json", action="store_true", help="the table as JSON as well")
    return parser.parse_args()


if __name__ == "__main__":
    main()
