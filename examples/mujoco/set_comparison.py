"""How the jumps of data sets differ: ranges over their recordings, side by side."""

import numpy as np

from assessment import assess, longest_flight
from jump_sets import jumps_of
from recording_format import read_recording, states_of

# Name -> decimals, in the order of the table.
QUANTITIES = {
    "trunk height at the start, m": 3,
    "least trunk height before take-off, m": 3,
    "thrust: from least height to take-off, s": 3,
    "forward speed at take-off, m/s": 2,
    "upward speed at take-off, m/s": 2,
    "largest absolute pitch before take-off, rad": 3,
    "distance, m": 3,
    "apex rise, m": 3,
    "flight, s": 3,
    "largest share of a torque limit": 2,
    "friction of the floor": 2,
    "time constant of the contact, s": 3,
}


def comparison(recordings, sets):
    """Markdown table of (lowest to highest) for each set of {name: JumpSet}; the recordings are in
    folders of their names. Rows are `QUANTITIES`."""
    columns = {}
    for name, jump_set in sets.items():
        values = [
            quantities(jump_set.robot, jump, recordings / name / f"{jump.stem}.csv.gz")
            for jump in jumps_of(jump_set)
        ]
        columns[name] = np.array(values).T
    lines = ["| | " + " | ".join(columns) + " |", "|---" * (1 + len(columns)) + "|"]
    for row, (quantity, digits) in enumerate(QUANTITIES.items()):
        spans = []
        for values in columns.values():
            low, high = (f"{v:.{digits}f}" for v in (values[row].min(), values[row].max()))
            spans.append(low if low == high else f"{low} to {high}")
        lines.append(f"| {quantity} | " + " | ".join(spans) + " |")
    return "\n".join(lines)


def quantities(robot, jump, path):
    """The numbers of one recorded jump, in the order of `QUANTITIES`."""
    columns = read_recording(path)
    x, dx, _, torque_nm, feet = states_of(columns)
    time_s = columns["Time"]
    whole = assess(robot, time_s, x, dx, torque_nm, feet)
    takeoff = longest_flight(feet)[0]
    lowest = int(x[:takeoff, 14].argmin())
    return (
        x[0, 14],
        x[lowest, 14],
        time_s[takeoff] - time_s[lowest],
        dx[takeoff, 12],
        dx[takeoff, 14],
        np.abs(x[:takeoff, 16]).max(),
        whole.distance_m,
        whole.apex_rise_m,
        whole.flight_s,
        whole.torque_share,
        jump.floor.friction,
        jump.floor.settling_s,
    )
