"""Metrics of a jump, and whether it counts as one; from recorded columns alone."""

from dataclasses import dataclass

import numpy as np

from robot_model import TORQUE_LIMIT_NM

MAX_TILT_RAD = 0.7
MIN_FINAL_HEIGHT_M = 0.2
MAX_FINAL_SPEED = 0.15


@dataclass(frozen=True)
class Assessment:
    """Figures of one jump (m, s, rad; `torque_share` is the largest |torque| / limit)."""

    duration_s: float
    distance_m: float
    apex_rise_m: float
    flight_s: float
    peak_torque_nm: tuple
    torque_share: float
    largest_tilt_rad: float
    lowest_height_m: float
    final_height_m: float
    final_speed: float

    def summary(self):
        return (
            f"{self.distance_m:.3f} m, flight {self.flight_s:.3f} s, "
            f"apex +{self.apex_rise_m:.3f} m, torque {100 * self.torque_share:.0f} % of the limit"
        )

    def faults(self, min_flight_s):
        """Reasons why this is no jump that ends standing upright; empty if there are none."""
        faults = []
        if self.flight_s < min_flight_s:
            faults.append(f"flight lasts {self.flight_s:.3f} s, less than {min_flight_s} s")
        if self.torque_share > 1.0:
            faults.append(f"torque reaches {100 * self.torque_share:.1f} % of its limit")
        if self.largest_tilt_rad > MAX_TILT_RAD:
            faults.append(f"roll or pitch reaches {self.largest_tilt_rad:.2f} rad")
        if self.final_height_m < MIN_FINAL_HEIGHT_M:
            faults.append(f"the trunk ends {self.final_height_m:.3f} m high")
        if self.final_speed > MAX_FINAL_SPEED:
            faults.append(f"the trunk still moves at {self.final_speed:.2f} m/s")
        return faults


def longest_flight(feet):
    """(first, last + 1) row of the longest span with no foot on the floor."""
    best, start = (0, 0), None
    for row, airborne in enumerate(np.append(~feet.any(axis=1), False)):
        if airborne and start is None:
            start = row
        elif not airborne and start is not None:
            if row - start > best[1] - best[0]:
                best = (start, row)
            start = None
    return best


def assess(robot, time_s, x, dx, torque_nm, feet):
    """Figures of a recorded jump of the named robot."""
    limit = np.tile(TORQUE_LIMIT_NM[robot], 4)
    first, last = longest_flight(feet)
    step = time_s[1] - time_s[0]
    peak = np.abs(torque_nm).reshape(-1, 4, 3).max(axis=(0, 1))
    return Assessment(
        duration_s=float(time_s[-1] - time_s[0]),
        distance_m=float(np.hypot(*(x[-1, 12:14] - x[0, 12:14]))),
        apex_rise_m=float(x[:, 14].max() - x[0, 14]),
        flight_s=float((last - first) * step),
        peak_torque_nm=tuple(float(v) for v in peak),
        torque_share=float((np.abs(torque_nm) / limit).max()),
        largest_tilt_rad=float(np.abs(x[:, 15:17]).max()),
        lowest_height_m=float(x[:, 14].min()),
        final_height_m=float(x[-1, 14]),
        final_speed=float(np.linalg.norm(dx[-1, 12:15])),
    )


def table(rows):
    """Markdown table of (name, Assessment) pairs."""
    lines = [
        "| jump | duration s | distance m | apex rise m | flight s "
        "| peak torque hx / hy / kn N m | of limit | largest tilt rad |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, a in rows:
        peak = " / ".join(f"{v:.1f}" for v in a.peak_torque_nm)
        lines.append(
            f"| {name} | {a.duration_s:.3f} | {a.distance_m:.3f} | {a.apex_rise_m:.3f} "
            f"| {a.flight_s:.3f} | {peak} | {100 * a.torque_share:.0f} % "
            f"| {a.largest_tilt_rad:.3f} |"
        )
    return "\n".join(lines)


def repetition_faults(reference, repeated, other_contact):
    """Why a run does not count as a repetition of a reference jump; empty if it does.

    It counts if only feet touch the floor, the longest flight lasts more than half the
    reference's, the apex rises by more than half the reference's, the distance ends within 35 %
    of the reference's, roll and pitch stay under 0.7 rad and the trunk ends higher than 0.2 m.
    """
    faults = []
    if other_contact:
        faults.append("fell")
    if repeated.flight_s <= 0.5 * reference.flight_s:
        faults.append(f"flight {repeated.flight_s:.2f} of {reference.flight_s:.2f} s")
    if repeated.apex_rise_m <= 0.5 * reference.apex_rise_m:
        faults.append(f"apex +{repeated.apex_rise_m:.2f} of {reference.apex_rise_m:.2f} m")
    if abs(repeated.distance_m - reference.distance_m) > 0.35 * reference.distance_m:
        faults.append(f"distance {repeated.distance_m:.2f} of {reference.distance_m:.2f} m")
    if repeated.largest_tilt_rad >= MAX_TILT_RAD:
        faults.append(f"tilt {repeated.largest_tilt_rad:.2f} rad")
    if repeated.final_height_m <= MIN_FINAL_HEIGHT_M:
        faults.append(f"ends {repeated.final_height_m:.2f} m high")
    return faults
