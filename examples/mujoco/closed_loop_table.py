"""The runs of the closed loop as a table, and the aims that they have to reach."""

import numpy as np

from perturbations import NOMINAL

WITH_INPUT, WITHOUT_INPUT = "MPC", "MPC, no recorded input"
# The MPC has to beat these on the test jumps of its training's recorder.
BASELINES = (
    "MPC, feedback off",
    "recorded torques + PD",
    "recorded torques alone",
    "PD alone",
)
LEAST_SHARE = 0.9
LEAST_WITHOUT_INPUT = 2


def summary(outcomes, perturbations, gains, missed):
    """The table as data: for every folder, follower and model the runs that succeed and all runs,
    by condition and in total, and how far distance and apex (m, medians) end from the recorded
    ones; the gains of the uninformed copies; the aims that are missed."""
    rows = []
    for folder, follower, model in dict.fromkeys(
        (o.recordings, o.follower, o.model) for o in sorted(outcomes, key=lambda o: o.recordings)
    ):
        chosen = [
            o
            for o in outcomes
            if (o.recordings, o.follower, o.model) == (folder, follower, model)
        ]
        conditions = {}
        for perturbation in perturbations:
            successes = [o.success for o in chosen if o.perturbation == perturbation.name]
            conditions[perturbation.name] = [sum(successes), len(successes)]
        rows.append(
            {
                "recordings": folder,
                "follower": follower,
                "model": model,
                "conditions": conditions,
                "succeeded": sum(o.success for o in chosen),
                "runs": len(chosen),
                "distance_error_m": float(np.median([abs(o.distance_error_m) for o in chosen])),
                "apex_error_m": float(np.median([abs(o.apex_error_m) for o in chosen])),
            }
        )
    return {
        "conditions": {p.name: p.short for p in perturbations},
        "uninformed_gains": gains,
        "rows": rows,
        "missed_aims": missed,
    }


def table(report):
    """Text of a `summary`: one table per folder, one row per follower and model."""
    lines = []
    short = report["conditions"].values()
    for folder in dict.fromkeys(row["recordings"] for row in report["rows"]):
        rows = [row for row in report["rows"] if row["recordings"] == folder]
        most = max(runs for row in rows for _, runs in row["conditions"].values())
        lines += [
            f"{folder}: successful runs, of {most} per condition; median errors in cm",
            "",
            f"{'who drives':<34}{'model':<16}"
            + "".join(f"{name:>8}" for name in short)
            + f"{'all':>11}{'distance':>10}{'apex':>6}",
        ]
        for row in rows:
            counts = "".join(f"{succeeded:>8}" for succeeded, _ in row["conditions"].values())
            share = f"{row['succeeded']}/{row['runs']}"
            errors = f"{100 * row['distance_error_m']:>10.1f}{100 * row['apex_error_m']:>6.1f}"
            lines.append(
                f"{row['follower']:<34}{row['model']:<16}{counts}{share:>11}{errors}"
            )
        lines.append("")
    for model, gains in report["uninformed_gains"].items():
        phases = ", ".join(f"{gain:.2f} in {phase}" for phase, gain in gains.items())
        lines.append(f"no dynamics: {model} with ddz = g u_lat, g = {phases} (scaled units)")
    return "\n".join(lines)


def missed_aims(outcomes, folder, models):
    """Which of the aims that the documentation states the runs on a folder do not reach.

    The comparison with baselines uses all runs of all folders: on single jumps all baselines succeed.
    """
    own = [o for o in outcomes if o.recordings == folder]
    nominal = [o for o in own if o.perturbation == NOMINAL.name]
    present = {o.follower for o in own}

    def share(among, follower):
        runs = [o.success for o in among if o.follower == follower]
        return sum(runs) / len(runs)

    missed = []
    if WITH_INPUT in present:
        if share(nominal, WITH_INPUT) < 1.0:
            missed.append(f"{WITH_INPUT}: all nominal runs succeed")
        if share(own, WITH_INPUT) < LEAST_SHARE:
            missed.append(f"{WITH_INPUT}: {LEAST_SHARE:.0%} of all runs succeed")
        for baseline in BASELINES:
            if baseline in present and share(outcomes, baseline) >= share(outcomes, WITH_INPUT):
                missed.append(f"{WITH_INPUT}: more runs succeed than with {baseline}")
    if WITHOUT_INPUT in present:
        succeeded = [o.success for o in nominal if o.follower == WITHOUT_INPUT]
        draws = 1 + max(o.draw for o in own)
        if sum(succeeded) < LEAST_WITHOUT_INPUT * models * draws:
            missed.append(
                f"{WITHOUT_INPUT}: {LEAST_WITHOUT_INPUT} nominal runs per model and draw succeed"
            )
    return missed
