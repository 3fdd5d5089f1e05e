"""The condition of a gear over a series."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence

from . import _gmhm, _html
from ._model import Model, Path, TorqueSide
from ._recording import Source, as_recordings
from ._results import Result


@dataclasses.dataclass(frozen=True)
class Quantity(Result):
    """A quantity of the gear."""

    name: str
    #: In `unit`.
    value: float
    #: Standard deviation, in `unit`.
    sd: float | None
    unit: str


@dataclasses.dataclass(frozen=True)
class Condition(Result):
    """A state of the gear."""

    #: The recording or model.
    name: str
    #: Mean temperature, °C.
    temperature_c: float | None
    #: Residual of a recording, N·m rms.
    rms: float | None
    #: Parameters, then catalogue figures.
    quantities: tuple[Quantity, ...]


@dataclasses.dataclass(frozen=True)
class Rating(Result):
    """The torques between which catalogues state stiffness, N·m (A)."""

    rated_torque: float
    t1: float
    t2: float


@dataclasses.dataclass(frozen=True)
class Change(Result):
    """A quantity over the series."""

    name: str
    unit: str
    #: First and last value, last minus first and its standard deviation, in `unit`.
    first: float
    last: float
    change: float
    sd: float | None
    #: The change relative to the first value.
    relative: float
    #: Probability that scatter alone causes such differences.
    p_value: float | None
    #: Whether it changed significantly, with Holm's correction for the number of quantities.
    moved: bool
    #: The smallest change that is detected in nine of ten cases, in `unit`.
    detectable: float | None


@dataclasses.dataclass(frozen=True)
class Regression(Result):
    """Regression of a quantity on a property."""

    name: str
    unit: str
    #: Value at the mean of the property, in `unit`; that mean.
    at_mean: float
    mean: float
    #: Change for a unit of the property, and its standard deviation, in `unit`.
    slope: float
    sd: float | None
    #: The slope relative to the value at the mean.
    relative_slope: float
    #: Scatter of the values about the line over their standard deviations; at least 1.
    scatter: float
    #: Probability of such a slope if there is no dependence.
    p_value: float | None
    significant: bool


@dataclasses.dataclass(frozen=True)
class Against(Result):
    """Regressions on a property of the recordings."""

    #: Its name, and its value for each state.
    property: str
    values: tuple[float, ...]
    regressions: tuple[Regression, ...]


@dataclasses.dataclass(frozen=True)
class Health(Result):
    """The condition of a gear over a series. `to_dict` is what `gmhm health --json` writes."""

    #: Probability that a change is reported although nothing has changed.
    false_alarm_rate: float
    #: `"nm"`; `"a"` where a current replaces the torque; all torques here are then in A.
    unit: str
    seed: int
    rating: Rating
    #: Law, kernel and gate.
    structure: str
    #: Factor on all standard deviations, because the halves of a recording differ by more.
    widened: float
    #: The states in the order given.
    conditions: tuple[Condition, ...]
    #: Each quantity over the series; empty for a single state.
    changes: tuple[Change, ...]
    against: Against | None

    def _repr_html_(self) -> str:
        if not self.changes:
            rows = ((q.name, q.value, q.sd, q.unit) for q in self.conditions[0].quantities)
            return _html.page(self.conditions[0].name, _html.table(("quantity", "value", "± 1 sd", "unit"), rows))
        moved = [change.name for change in self.changes if change.moved]
        heading = f"Changed: {', '.join(moved)}" if moved else "No change"
        changes = ((c.name, c.first, c.last, c.change, c.sd, c.unit, c.moved) for c in self.changes)
        head = ("quantity", "first", "last", "change", "± 1 sd", "unit", "changed")
        return _html.page(f"{heading} ({len(self.conditions)} states)", _html.table(head, changes))


def health(
    recordings: Source = None,
    *,
    models: Sequence[Path] | None = None,
    model: Model | None = None,
    against: str | None = None,
    rated_torque: float | None = None,
    t1: float | None = None,
    t2: float | None = None,
    own_zeros: bool = False,
    rated_deflection_rad: float | None = None,
    ratio: float | None = None,
    torque_side: TorqueSide | None = None,
    seed: int = 1,
) -> Health:
    """Follows the condition of a gear: what changed between recordings or fits, as `gmhm health`.

    Args:
        recordings: one or a list, in order, as for `fit`. Of a single one, its catalogue figures.
        models: instead of recordings, paths of model files, in order; with what `gmhm fit --json` wrote beside each
            (`gear.toml`, `gear.json`) they have uncertainty too.
        model: gives law, kernel, gate and rated deflection; by default all recordings choose.
        against: the property that quantities are regressed on: `"temperature_c"`, or `"TABLE.csv:COLUMN"`.
        rated_torque, t1, t2: as the catalogue has them, N·m (A); by default from the rated deflection.
        own_zeros: the zero of the encoder of every recording is estimated; by default where it is seen to differ from
            none.
        rated_deflection_rad, ratio, torque_side, seed: as for `fit`.
    """
    rating = [rated_torque, t1, t2]
    if models is not None:
        if recordings is not None:
            raise TypeError("health takes recordings or models, not both")
        return Health.from_dict(json.loads(_gmhm.health_of_models(list(models), rating, against, seed)))
    text = _gmhm.health_of_recordings(
        as_recordings([] if recordings is None else recordings, "fit"),
        None if model is None else model._native,
        own_zeros,
        rated_deflection_rad,
        ratio,
        torque_side,
        rating,
        against,
        seed,
    )
    return Health.from_dict(json.loads(text))
