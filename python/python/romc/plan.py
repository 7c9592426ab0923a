"""Jumps that nobody recorded."""

from __future__ import annotations

import json
from typing import Any, Dict

from romc import _romc
from romc.recording import Recording


class Plan(Recording):
    """A planned jump: a recording of one segment, which `Model.simulate`, `Controller.set_reference` and every command
    take.

    `summary` is the object of `romc plan --json`: `distance_m`, `apex_m` (of the planned motion), `goal_m`,
    `durations_s` by part, `cost`, `input_deviation` (largest deviation of the input from the training's, in standard
    deviations), `extrapolates`, `reasons`, `status`, `solve_ms` and so on.
    """

    summary: Dict[str, Any]

    def __init__(self, native: "_romc.Recording", summary: str) -> None:
        super().__init__(native)
        self.summary = json.loads(summary)

    @property
    def status(self) -> str:
        """`trusted`, `extrapolates`, or `refused` if it was forced."""
        status: str = self.summary["status"]
        return status

    def __repr__(self) -> str:
        reached = f"{self.summary['distance_m']:.3f} m, apex {self.summary['apex_m']:.3f} m"
        return f"<Plan of {reached}, {self.status}>"
