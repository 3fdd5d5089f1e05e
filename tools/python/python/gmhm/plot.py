"""Pictures of results, by matplotlib (`pip install gmhm[plot]`). Each function draws into `axes`, or into new ones, and returns them."""

# Matplotlib leaves some of its arguments without types.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib.pyplot as plt

from ._diagnosis import Diagnosis
from ._fit import Fit
from ._health import Health
from ._model import Model
from ._recording import Recording

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def loop(fit: Fit, index: int = 0, *, axes: Axes | None = None) -> Axes:
    """Torque over deflection of one of the recordings of a fit: measured, and as the model predicts it."""
    axes = _axes(axes)
    recording, offset = fit.recordings[index], fit.offsets[index]
    deflection_mrad = 1e3 * recording.deflection_rad
    axes.plot(deflection_mrad, recording.torque - offset, ".", markersize=2, label="measured")
    axes.plot(deflection_mrad, fit.predictions[index], linewidth=1, label=f"model, {fit.heldout_rms:.3g} {_unit(fit.unit)} held out")
    return _labelled(axes, "deflection, mrad", f"torque, {_unit(fit.unit)}", recording.name)


def residual(fit: Fit, index: int = 0, *, axes: Axes | None = None) -> Axes:
    """The residual of one recording of a fit, over time."""
    axes = _axes(axes)
    recording = fit.recordings[index]
    axes.plot(recording.time_s, fit.residuals[index], linewidth=0.7, label="measured − fitted")
    return _labelled(axes, "time, s", f"torque, {_unit(fit.unit)}", recording.name)


def torque(model: Model, recording: Recording, *, axes: Axes | None = None) -> Axes:
    """The torque of a recording over time: measured, as a model predicts it, and each part of the model."""
    axes = _axes(axes)
    prediction = model.predict(recording)
    if {"torque_nm", "current_a"} & set(recording.columns):
        axes.plot(recording.time_s, recording.torque, ".", markersize=2, label="measured")
    parts = {"model": prediction.torque, "elastic": prediction.elastic, "hysteresis": prediction.hysteresis}
    for name, values in (parts | prediction.terms).items():
        axes.plot(recording.time_s, values, linewidth=1, label=name)
    return _labelled(axes, "time, s", f"torque, {_unit(model.torque_unit)}", recording.name)


def effects(diagnosis: Diagnosis, *, axes: Axes | None = None) -> Axes:
    """The effects that a diagnosis found, by their share of the structure."""
    axes = _axes(axes)
    names = [effect.name for effect in diagnosis.effects]
    axes.barh(names, [100 * effect.share for effect in diagnosis.effects])
    axes.invert_yaxis()
    return _labelled(axes, "share of the structure, %", "", "missing physics")


def trend(health: Health, name: str, *, axes: Axes | None = None) -> Axes:
    """A quantity over a series, with two standard deviations."""
    axes = _axes(axes)
    found = [quantity for condition in health.conditions for quantity in condition.quantities if quantity.name == name]
    if not found:
        raise KeyError(f"{name}; the quantities are {', '.join(q.name for q in health.conditions[0].quantities)}")
    errors = [2 * (quantity.sd or 0.0) for quantity in found]
    axes.errorbar(range(1, len(found) + 1), [quantity.value for quantity in found], errors, fmt="o", capsize=3, label="± 2 sd")
    return _labelled(axes, "state", f"{name}, {found[0].unit}", "")


def _axes(axes: Axes | None) -> Axes:
    return plt.subplots()[1] if axes is None else axes


def _labelled(axes: Axes, x: str, y: str, title: str) -> Axes:
    axes.set(xlabel=x, ylabel=y, title=title)
    if axes.get_legend_handles_labels()[0]:
        axes.legend()
    return axes


def _unit(unit: str) -> str:
    return "A" if unit == "a" else "N·m"
