"""Hysteresis of harmonic drives: identify it from recordings, predict it, diagnose missing effects.

The functions do what the commands of the same names do, by the same code: their numbers are equal. Units are SI, and
names state them: `time_s`, `torque_nm`, `deflection_rad`.

    recording = gmhm.read("recording.csv")
    fit = gmhm.fit(recording)
    fit.model.save("gear.toml")
    torque_nm = fit.model.predict(recording).torque

`gmhm.plot` draws results; it needs matplotlib (`pip install gmhm[plot]`).
"""

from __future__ import annotations

from typing import Any

from ._diagnosis import Diagnosis, diagnose
from ._errors import (
    BlockError,
    DiagnoseError,
    FitError,
    GmhmError,
    HealthError,
    InvertError,
    ModelError,
    Note,
    OptionError,
    OutputError,
    PredictError,
    RecordingError,
    SimulateError,
)
from ._fit import Fit, fit
from ._health import Health, health
from ._model import Block, Inversion, Model, Prediction, Simulation, Term
from ._recording import Recording, demo, read

__all__ = [
    "Block",
    "BlockError",
    "DiagnoseError",
    "Diagnosis",
    "Fit",
    "FitError",
    "GmhmError",
    "Health",
    "HealthError",
    "Inversion",
    "InvertError",
    "Model",
    "ModelError",
    "Note",
    "OptionError",
    "OutputError",
    "PredictError",
    "Prediction",
    "Recording",
    "RecordingError",
    "SimulateError",
    "Simulation",
    "Term",
    "demo",
    "diagnose",
    "fit",
    "health",
    "read",
]


def __getattr__(name: str) -> Any:
    # Matplotlib is imported when something is drawn.
    if name == "plot":
        from importlib import import_module

        return import_module(".plot", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
