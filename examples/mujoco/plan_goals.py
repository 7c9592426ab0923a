"""Plans all goals that seeds draw, without simulating them, and prints what `romc plan` answers."""

import argparse
import collections
import pathlib
import re
import tempfile

import numpy as np

from plan_jumps import ROMC, ROOT, drawn_goals, planned

EXAMPLE = """example:
  cargo build --release
  python plan_goals.py --seeds 1 2 3 9 10
plans the 12 goals inside and the 6 outside of each seed one after the other, as plan_jumps.py does."""


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, nargs="+", default=[1], help="of the goals (default: 1)")
    parser.add_argument("--model", type=pathlib.Path, default=ROOT / "models/go1-d7.json")
    parser.add_argument("--romc", type=pathlib.Path, default=ROMC, help="the compiler")
    arguments = parser.parse_args()
    arguments.settings = None
    answers = {"inside": [], "outside": []}
    with tempfile.TemporaryDirectory() as folder:
        arguments.out_dir = pathlib.Path(folder)
        for goal in (goal for seed in arguments.seeds for goal in drawn_goals(seed)):
            _, answer = planned(arguments, {"plan": arguments.model}, "plan", goal)
            answers["inside" if goal.name.startswith("in") else "outside"].append(answer)
    for place, of_place in answers.items():
        statuses = collections.Counter(answer.get("status", "no plan") for answer in of_place)
        print(f"goals {place}: {len(of_place)}; " + ", ".join(f"{n} {name}" for name, n in statuses.items()))
    plans = [answer for of_place in answers.values() for answer in of_place if answer]
    if not plans:
        raise SystemExit("no goal has a plan")
    # Reasons differ in their numbers: the same without them is the same reason.
    reasons = collections.Counter(re.sub(r"\d+(\.\d+)?", "N", text) for plan in plans for text in plan["reasons"])
    for text, count in reasons.items():
        print(f"warning of {count} plans: {text}")
    times = [plan["solve_ms"] for plan in plans]
    print(f"largest share of a torque limit between the nodes: {max(p['margins']['torque_share'] for p in plans):.2f}")
    print(f"time of a plan: median {np.median(times):.0f} ms, longest {max(times):.0f} ms")


if __name__ == "__main__":
    main()
