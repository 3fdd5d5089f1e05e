"""Identification of a gear from recordings."""

from __future__ import annotations

import dataclasses
import json
from typing import Literal

from . import _gmhm, _html
from ._health import Condition
from ._model import Model, TorqueSide
from ._recording import Array, Recording, Source, as_recordings
from ._results import Result, beside_json

Grade = Literal["good", "caution", "bad"]


@dataclasses.dataclass(frozen=True)
class Reason(Result):
    """A reason of a verdict."""

    #: The grade that it leads to.
    grade: Grade
    #: The reason, as a clause.
    words: str


@dataclasses.dataclass(frozen=True)
class Verdict(Result):
    """Whether a fit is good enough for the drive."""

    #: The grade of the most severe reason.
    grade: Grade
    #: One sentence.
    sentence: str
    #: Every reason, the most severe first.
    reasons: tuple[Reason, ...]


@dataclasses.dataclass(frozen=True)
class Parameter(Result):
    """A parameter as estimated."""

    #: Its name in model files, that of a term after its kind and a dot; e, h and ρ by their symbols.
    name: str
    #: Its value, in `unit`.
    value: float
    #: Standard deviation, in `unit`; None where the recordings do not determine the parameter by itself.
    sd: float | None
    #: Unit of both.
    unit: str
    #: Whether it is held at a bound.
    at_bound: bool
    #: Whether the recordings do not distinguish it from zero, or do not determine it.
    undetermined: bool
    #: A remark, and the experiment that would determine it.
    note: str | None


@dataclasses.dataclass(frozen=True)
class Candidate(Result):
    """A structure that was tried."""

    #: `law/kernel/gate`, with `+play` where a play was fitted.
    name: str
    #: Number of parameters.
    parameters: int
    #: Root mean square of the residual of the rows fitted, N·m.
    rms: float
    #: Root mean square of the error on rows held out, N·m.
    heldout_rms: float
    #: Whether it was chosen.
    chosen: bool
    #: Whether it predicts as well as the best.
    tied: bool


@dataclasses.dataclass(frozen=True)
class Comparison(Result):
    """Another model on the same recordings."""

    #: Its name.
    model: str
    #: Number of its parameters, without the offset of each recording.
    parameters: int
    #: Instructions a sample on a Cortex-M4F in f32.
    instructions: int | None
    #: Residual sum of squares, N²·m².
    rss: float
    #: Root mean square of the residual, N·m.
    rms: float
    #: Root mean square of the error on blocks held out, N·m.
    heldout_rms: float
    #: Root mean square of the error on each recording when it is held out whole, N·m.
    unseen_recording_rms: float | None


@dataclasses.dataclass(frozen=True)
class Coverage(Result):
    """Range that recordings of a gear cover."""

    #: rad.
    rated_deflection_rad: float
    #: Lowest and highest, about the gear's zero, rad.
    deflection_rad: tuple[float, float]
    #: Median and 95th percentile of its size while it moves, rad/s.
    rate_rad_per_s: tuple[float, float]
    #: Strokes between reversals.
    strokes: int
    #: Of these, how many ended well inside the extremes.
    inner_reversals: int


@dataclasses.dataclass(frozen=True)
class JointCoverage(Result):
    """Range that joint logs cover."""

    #: Lowest and highest output angle, rad.
    angle_rad: tuple[float, float]
    #: Fastest movement each way, rad/s.
    velocity_rad_per_s: tuple[float, float]


@dataclasses.dataclass(frozen=True)
class Repeated(Result):
    """The part of a residual that repeats at the same deflection and direction."""

    #: Share of its power.
    share: float
    #: Whether noise alone reaches this share in less than 1 % of cases.
    significant: bool


@dataclasses.dataclass(frozen=True)
class Clipped(Result):
    """A channel that was driven beyond its range."""

    recording: str
    channel: str
    #: The channel that continues to change.
    other: str
    #: The value at which it stays, in `unit`.
    at: float
    unit: str


@dataclasses.dataclass(frozen=True)
class DoubtfulUnit(Result):
    """A quantity that no gear reaches."""

    column: str
    #: Its largest size, in `unit`.
    size: float
    #: What gears reach at most, in `unit`.
    limit: float
    unit: str
    grade: Grade


@dataclasses.dataclass(frozen=True)
class BetterRated(Result):
    """A rated deflection that suits the recordings better than the one given."""

    #: rad.
    rated_deflection_rad: float
    #: Error on blocks held out with it, and with the one given, N·m rms.
    heldout_rms: float
    given_heldout_rms: float


@dataclasses.dataclass(frozen=True)
class BetterSide(Result):
    """The other side of the gear, where it suits the recordings of a joint better: friction and inertia have the other sign."""

    torque_side: Literal["motor", "output"]
    #: Error on blocks held out with it, and with the side of the fit, N·m rms.
    heldout_rms: float
    given_heldout_rms: float


@dataclasses.dataclass(frozen=True)
class DeflectionZero(Result):
    """Where the deflection of a recording is zero."""

    recording: str
    #: rad.
    rad: float
    #: Standard deviation, rad.
    sd_rad: float | None


@dataclasses.dataclass(frozen=True)
class Noise(Result):
    """The noise of a recording: an autoregression."""

    #: Its coefficients, of lag 1 first.
    coefficients: tuple[float, ...]
    #: Standard deviation of its innovations, N·m.
    innovation_sd: float
    #: Root mean square, N·m.
    rms: float
    #: Outliers: rows that are not used.
    outliers: int
    #: Step of the torque's converter, N·m, and of the deflection's, rad, where one was seen.
    torque_step_nm: float | None
    deflection_step_rad: float | None


@dataclasses.dataclass(frozen=True)
class Fit(Result):
    """A fit and what is known about it. `to_dict` is what `gmhm fit --json` writes; arrays and the model are further fields."""

    verdict: Verdict
    #: Range that the recordings cover; None for joint logs, which have the next field.
    coverage: Coverage | None
    joint_coverage: JointCoverage | None
    #: The part of the residual that repeats; None if the recordings are too short to decide.
    structure: Repeated | None
    #: Other models on the same recordings, the gear's own first; only that with `compare=False`.
    comparison: tuple[Comparison, ...]
    comparison_rows: int
    #: Largest deviation of the torque from its mean, N·m.
    torque_peak: float
    clipped: tuple[Clipped, ...]
    doubtful_units: tuple[DoubtfulUnit, ...]
    better_rated: BetterRated | None
    better_side: BetterSide | None
    method: Literal["auto", "pso"]
    seed: int
    #: `"nm"`; `"a"` where a current replaces the torque; all torques here are then in A.
    unit: str
    parameters: tuple[Parameter, ...]
    #: Names in the order of `correlation`, a matrix by rows.
    correlated: tuple[str, ...]
    correlation: tuple[tuple[float, ...], ...]
    #: Whether no rated deflection was given, and it is the largest recorded.
    rated_is_largest_seen: bool
    #: Structures tried, and how many rows they were compared on.
    selection: tuple[Candidate, ...]
    selection_rows: int
    #: Root mean square (N·m) and sum of squares (N²·m²) of the residual of the rows used.
    rms: float
    rss: float
    #: Root mean square of the error on blocks held out, N·m.
    heldout_rms: float
    #: Rows used.
    rows: int
    #: Constant torque offset of each recording, N·m. Not part of the model.
    offsets: tuple[float, ...]
    deflection_zeros: tuple[DeflectionZero, ...]
    #: Of each recording: whether it starts with an empty memory; rows before its loop had settled, which are not used; its noise.
    known_start: tuple[bool, ...]
    unsettled_rows: tuple[int, ...]
    #: Of each recording, rows near standstill that are not used: the noise of the motion alone changes the friction there by about as much as the residual.
    rows_near_standstill: tuple[int, ...]
    noise: tuple[Noise, ...]
    #: Whether rows were weighted against that noise; otherwise the fit is plain least squares.
    prewhitened: bool
    #: Whether the parameters are held where feed-forward has an inverse.
    held_invertible: bool
    #: Why the search stopped, and its evaluations.
    stop: str
    evaluations: int
    #: K1, K2, K3, hysteresis loss and lost motion; None of a joint log.
    catalogue: Condition | None

    #: The model.
    model: Model = beside_json()
    #: The recordings as they were fitted: deflections derived, dropouts interpolated, zeros aligned.
    recordings: tuple[Recording, ...] = beside_json()
    #: Of each recording, measured minus fitted torque, N·m; shape `(rows,)`.
    residuals: tuple[Array, ...] = beside_json()
    #: Of each recording, the torque that the model predicts from rest, without offset, N·m; shape `(rows,)`.
    predictions: tuple[Array, ...] = beside_json()

    def parameter(self, name: str) -> Parameter:
        """A parameter by its name; `KeyError` where there is none."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise KeyError(f"{name}; the parameters are {', '.join(p.name for p in self.parameters)}")

    def _repr_html_(self) -> str:
        parameters = ((p.name, p.value, p.sd, p.unit, p.note) for p in self.parameters)
        reasons = _html.table(("reason", "grade"), ((r.words, r.grade) for r in self.verdict.reasons))
        unit = "A" if self.unit == "a" else "N·m"
        residual = f"Residual: {self.rms:.4g} {unit} rms over {self.rows} rows; {self.heldout_rms:.4g} on blocks held out."
        return _html.page(
            self.verdict.sentence,
            _html.table(("parameter", "value", "± 1 sd", "unit", ""), parameters),
            _html.paragraph(residual),
            reasons if self.verdict.reasons else "",
        )


def fit(
    recordings: Source,
    *,
    model: Model | None = None,
    method: Literal["auto", "pso"] = "auto",
    own_zeros: bool = False,
    rated_deflection_rad: float | None = None,
    ratio: float | None = None,
    torque_side: TorqueSide | None = None,
    name: str | None = None,
    seed: int = 1,
    compare: bool = True,
) -> Fit:
    """Identifies a gear from recordings, with the uncertainty of every parameter, as `gmhm fit`.

    Args:
        recordings: one recording or a list, all of one gear: each a `Recording`, a path, a dict of arrays or a frame,
            with `time_s`, `torque_nm` (or `current_a`) and `deflection_rad` (or two angles and `ratio`).
        model: gives ratio, law, kernel, gate and play; without it held-out prediction chooses them.
        method: `"auto"`, or `"pso"`, the paper's particle swarm.
        own_zeros: estimate one encoder zero per recording; by default only where the recordings do
            not go together otherwise.
        rated_deflection_rad: rad; else the model's, else the largest recorded.
        ratio: reduction ratio, negative where the gear reverses; else the model's.
        torque_side: where the torque is measured; by default as in the model, otherwise the output (motor for a current).
        name: of the gear, in the model.
        seed: of every random choice.
        compare: also fit other models and another rated deflection, for the verdict; without it a fit is several times
            faster.

    Raises:
        RecordingError, FitError: what is wrong, where, and how to fix it.
    """
    text, native, ready, residuals, predictions = _gmhm.fit(
        as_recordings(recordings, "fit"),
        None if model is None else model._native,
        method,
        own_zeros,
        rated_deflection_rad,
        ratio,
        torque_side,
        name,
        seed,
        compare,
    )
    return Fit.from_dict(
        json.loads(text),
        model=Model(native),
        recordings=tuple(map(Recording, ready)),
        residuals=tuple(residuals),
        predictions=tuple(predictions),
    )
