"""What a model leaves out."""

from __future__ import annotations

import dataclasses
import json
from typing import Literal

from . import _gmhm, _html
from ._model import Model, TorqueSide
from ._recording import Source, as_recordings
from ._results import Result, beside_json, left_out_if_none


@dataclasses.dataclass(frozen=True)
class Rms(Result):
    """Root mean square residuals, in the unit of the diagnosis."""

    #: Of the model given; of that model, its own parameters refitted; of the model with what was found.
    given: float
    refitted: float
    extended: float


@dataclasses.dataclass(frozen=True)
class Heldout(Rms):
    """The same on rows that took no part in the fit."""

    #: Which rows those were.
    from_: Literal["blocks", "recordings"]


@dataclasses.dataclass(frozen=True)
class Location(Result):
    """A coordinate along which the residual has structure."""

    #: Such as `motor_angle`, `output_velocity`, `temperature`.
    coordinate: str
    #: Share of the structure's power that a function of it explains, 0 to 1.
    share: float
    #: What is seen there, in words.
    detail: str
    #: The stretches of time concerned, s.
    seconds: tuple[tuple[float, float], ...]


@dataclasses.dataclass(frozen=True)
class EffectParameter(Result):
    """A parameter of an effect."""

    #: As in the model file.
    value: float | tuple[float, ...] | str
    #: Standard deviation, shaped like `value`; None of a choice and of what was held fixed.
    sd: float | tuple[float, ...] | None = left_out_if_none()
    #: Of both.
    unit: str = ""


@dataclasses.dataclass(frozen=True)
class Closest(Result):
    """The kind closest to an effect without a name."""

    name: str
    fidelity: float | None


@dataclasses.dataclass(frozen=True)
class Effect(Result):
    """A missing piece of physics."""

    #: Its kind, or `unknown`.
    name: str
    verdict: Literal["named", "approximate", "unknown"]
    #: Part of what a free function of its coordinates predicts that the kind predicts, 0 to 1.
    fidelity: float | None
    #: elastic, memory, friction, load, transmission, measurement or unknown.
    family: str
    closest: Closest | None
    #: Every other kind that these recordings cannot distinguish from it.
    equivalents: tuple[str, ...]
    #: Weight of the class {name, equivalents} among what was tried, 0 to 1.
    confidence: float
    #: Share of the structure's power that it explains, 0 to 1.
    share: float
    #: The keys of the model file's `[[term]]`.
    parameters: dict[str, EffectParameter]
    #: `plant`: compensated on the drive; `instrument`: a fault of the measurement.
    side: Literal["plant", "instrument", "unknown"]
    #: The evidence, in words.
    why: str


@dataclasses.dataclass(frozen=True)
class Undecidable(Result):
    """A kind that the recordings could not have shown."""

    name: str
    #: The experiment that would show it.
    experiment: str


@dataclasses.dataclass(frozen=True)
class Diagnosis(Result):
    """Where recordings differ from a model, and why. `to_dict` is what `gmhm diagnose --json` writes."""

    #: Whether there is structure beyond noise, at this rate of false alarms.
    mismatch: bool
    false_alarm_rate: float
    #: `"nm"`; `"a"` where a current replaces the torque; all torques here are then in A.
    unit: str
    #: Of the noise as estimated, N·m rms.
    noise_rms: float
    rms: Rms
    heldout: Heldout
    #: Parts of the base model's squared error, held out, that are predicted: by free curves, by the extended model, by its
    #: effects without curves; 0 to 1.
    predictable: float
    explained: float
    named: float
    #: Largest share first; empty without a mismatch.
    where: tuple[Location, ...]
    effects: tuple[Effect, ...]
    undecidable: tuple[Undecidable, ...]
    #: Settings of the model or the recording that are probably wrong.
    suggestions: tuple[str, ...]
    #: The experiment that best answers the open questions; empty if there are none.
    next_experiment: str

    #: The extended model; the refitted base where nothing was found.
    model: Model = beside_json()

    def _repr_html_(self) -> str:
        if not self.mismatch:
            heading = f"No structure beyond noise (false alarms: {self.false_alarm_rate:.0%})"
        else:
            heading = "Missing: " + ", ".join(effect.name for effect in self.effects)
        effects = ((e.name, f"{e.share:.0%}", f"{e.confidence:.2f}", ", ".join(e.equivalents), e.why) for e in self.effects)
        residuals = (
            (name, rms.given, rms.refitted, rms.extended) for name, rms in (("fitted", self.rms), ("held out", self.heldout))
        )
        return _html.page(
            heading,
            _html.table(("effect", "share", "confidence", "or", "why"), effects) if self.effects else "",
            _html.table((f"residual, rms in {'A' if self.unit == 'a' else 'N·m'}", "given", "refitted", "extended"), residuals),
            _html.paragraph(f"Next bench test: {self.next_experiment}") if self.next_experiment else "",
        )


def diagnose(
    recordings: Source,
    model: Model | None = None,
    *,
    holdout: Source = (),
    own_zeros: bool = False,
    rated_deflection_rad: float | None = None,
    ratio: float | None = None,
    torque_side: TorqueSide | None = None,
    name: str | None = None,
    seed: int = 1,
) -> Diagnosis:
    """Finds where recordings differ from a model and which physics is missing, as `gmhm diagnose`.

    Args:
        recordings: one or a list, of one gear or joint, as for `fit`.
        model: the base; without one, recordings with `torque_sim_nm`, another simulator's torque.
        holdout: recordings that are not used in the diagnosis; the models' errors on them are reported.
        own_zeros: estimate one encoder zero per recording.
        name: of the gear, in the extended model.
        rated_deflection_rad, ratio, torque_side, seed: as for `fit`.
    """
    text, native = _gmhm.diagnose(
        as_recordings(recordings, "diagnose"),
        None if model is None else model._native,
        as_recordings(holdout, "diagnose"),
        own_zeros,
        rated_deflection_rad,
        ratio,
        torque_side,
        name,
        seed,
    )
    return Diagnosis.from_dict(json.loads(text), model=Model(native))
