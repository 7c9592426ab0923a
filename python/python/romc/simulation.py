"""Rollouts along recordings."""

from __future__ import annotations

import json
from typing import Any, Dict, List

import numpy as np
from numpy.typing import NDArray

from romc import _romc
from romc._arrays import Floats


class SimulatedSegment:
    """Recorded and predicted samples of one segment, one row each.

    `z`, `dz`, `ddz`, `u_lat` are `(n, d)`, recorded, in the model's scaled units; `x` is `(n, 18)`, recorded, in SI
    units. `z_full`, `dz_full` and `x_full` are predicted from the first sample on, `z_restarted`, `dz_restarted`
    and `x_restarted` from the recorded state at each restart; NaN where a rollout has diverged.
    """

    t: Floats
    phase: NDArray[np.int64]
    z: Floats
    dz: Floats
    ddz: Floats
    u_lat: Floats
    x: Floats
    z_full: Floats
    dz_full: Floats
    x_full: Floats
    z_restarted: Floats
    dz_restarted: Floats
    x_restarted: Floats

    def __init__(self, arrays: Dict[str, Any]) -> None:
        self.__dict__.update(arrays)

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        return f"<SimulatedSegment of {len(self)} samples>"


class Score(Dict[str, Any]):
    """The verdict on a model along recordings, as every command gives it; `print` shows a line for each row.

    - `fit_for`, `failed`: uses of the model, of `0.1 s` (errors of predictions over that time), `whole motion` (errors
      from the first sample on; of walks `a stride`), `torques` (those that the controller finds itself), `control`;
    - `rows`: the metrics that decide, a dict each: `use`, `name`, `unit`, `value`, `baseline`, `baseline_name`,
      `best_baseline` and its name, `threshold`, `bound` (`at most` or `at least`), `passed` (`None` if not measured)
      and `counts`. Errors are root mean squares in m or rad, on the worst recording for torques and control;
    - `unmeasured`: why torques and control are not judged, or `None`.
    """

    def __init__(self, verdict: str, text: str) -> None:
        super().__init__(json.loads(verdict))
        self._text = text

    def __str__(self) -> str:
        return self._text


class Simulation:
    """Predictions of a model along recordings.

    `metrics` is the object `rollouts` of `romc simulate --json`: rms (rad, m) and R^2 of each coordinate over whole
    rollouts and restarted ones, baselines, losses. `verdict` is that of every command: `fit_for`, `failed` and the
    `rows` that decide, each with value, baseline, threshold and passed. `runs` has the trajectories, one entry per
    segment.
    """

    metrics: Dict[str, Any]
    verdict: Dict[str, Any]
    runs: List[SimulatedSegment]

    def __init__(self, model: "_romc.Model", recordings: List["_romc.Recording"], restart_every: float) -> None:
        metrics, runs = _romc.simulate(model, recordings, restart_every)
        results = json.loads(metrics)
        self.metrics = results["metrics"]
        self.verdict = results["verdict"]
        self.runs = [SimulatedSegment(arrays) for arrays in runs]

    def rms(self, coordinate: str, rollouts: str = "restarted") -> float:
        """Root mean square error of a coordinate such as `body.z` (rad or m), of `restarted` or `full` rollouts."""
        value = self.metrics[rollouts]["coordinates"][coordinate]["rms"]
        return float("nan") if value is None else float(value)

    def __repr__(self) -> str:
        return f"<Simulation of {len(self.runs)} segments>"
