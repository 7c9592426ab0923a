"""Reduced-order models of legged robots: equations, code, rollouts, control.

>>> import romc
>>> model = romc.Model.load("go1-d4")
>>> print(model)
>>> jumps = romc.recordings("go1")
>>> print(model.score(jumps))

Arrays have one row per sample, in SI units: states `x` are `(n, 18)` (12 joint angles in rad, body position in m,
roll, pitch, yaw in rad), torques `(n, 12)` in N m, feet `(n, 4)` booleans in the order fr, fl, rr, rl. Latent
quantities are `(n, d)` in the model's scaled units.
"""

from romc._romc import __version__
from romc.controller import STATUSES, Command, ControlRun, Controller
from romc.equations import Equations
from romc.errors import ModelError, RecordingError, RomcError, RomcWarning
from romc.inspection import Identification, ModelInspection, RecordingInspection, identify, inspect
from romc.library import Library
from romc.model import MODELS, Model, Simplified
from romc.plan import Plan
from romc.recording import Recording, Segment, guess_columns, read, recordings
from romc.simulation import Score, Simulation, SimulatedSegment
from romc.training import study, train

__all__ = [
    "Command",
    "ControlRun",
    "Controller",
    "Equations",
    "Identification",
    "Library",
    "MODELS",
    "Model",
    "ModelError",
    "ModelInspection",
    "Plan",
    "Recording",
    "RecordingError",
    "RecordingInspection",
    "RomcError",
    "RomcWarning",
    "STATUSES",
    "Score",
    "Segment",
    "Simplified",
    "SimulatedSegment",
    "Simulation",
    "__version__",
    "guess_columns",
    "identify",
    "inspect",
    "read",
    "recordings",
    "study",
    "train",
]
