"""Models: files, prediction, inversion, simulation, and the parameter block of a drive."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from . import _gmhm, _html
from ._recording import Array, Recording, Source, as_recording
from ._results import Result, Series

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Path: TypeAlias = str | os.PathLike[str]
TorqueSide: TypeAlias = Literal["motor", "output"]


@dataclasses.dataclass(frozen=True, eq=False)
class Prediction(Series):
    """The torque of every row, in the unit of the model: N·m, or A."""

    #: Elastic plus hysteresis torque plus terms; shape `(rows,)`.
    torque: Array
    #: Elastic torque f(θ); shape `(rows,)`.
    elastic: Array
    #: Hysteresis torque; shape `(rows,)`.
    hysteresis: Array
    #: What each term adds, by its name; each of shape `(rows,)`.
    terms: dict[str, Array]
    #: Rows outside the rated deflection, where the model is not calibrated.
    rows_out_of_range: int
    #: Pairs of turning points that were merged because more loops were open than can be stored.
    merged_pairs: int


@dataclasses.dataclass(frozen=True, eq=False)
class Inversion(Series):
    """The deflection for every torque."""

    #: The deflection as the encoders show it, rad; shape `(rows,)`.
    deflection_rad: Array
    #: Whether the torque is beyond the range of the model, and the deflection its edge; shape `(rows,)`.
    saturated: NDArray[np.bool_]
    #: The edge, rad from the model's zero.
    range_rad: float
    #: As of a prediction.
    merged_pairs: int


@dataclasses.dataclass(frozen=True)
class Term(Result):
    """A `[[term]]` of a model: a kind of physics and its parameters."""

    #: Its kind, such as `kinematic_error`.
    kind: str
    #: Its keys, as in the model file; each names its unit.
    values: dict[str, float | list[float] | str]


@dataclasses.dataclass(frozen=True, eq=False)
class Simulation(Series):
    """What the sensors of the virtual test bench recorded, and what was true."""

    #: The recording.
    recording: Recording
    #: The true values, as `gmhm simulate --key` writes them: `simulation`, `hidden`, `truth`.
    key: dict[str, Any]
    #: The gear that was simulated, hidden physics included.
    truth: Model


@dataclasses.dataclass(frozen=True)
class Block:
    """The parameter block of a drive."""

    #: Its bytes.
    data: bytes = dataclasses.field(repr=False)
    #: Why the drive can only predict and not invert; None if it can do both.
    without_inverse: str | None = None

    @classmethod
    def load(cls, path: Path) -> Block:
        """Reads a `.bin` or `.hex`. A damaged, incompatible or invalid block raises `BlockError`."""
        return cls(_gmhm.read_block(path))

    def save(self, path: Path, *, address: int = 0) -> None:
        """Writes it in the format of the path's ending: `.bin`, `.hex` (Intel HEX at an address) or `.h` (an array for C)."""
        _gmhm.write_block(self.data, path, address)

    def to_dict(self) -> dict[str, Any]:
        """Its contents in SI units, as `gmhm inspect --json` writes it."""
        contents: dict[str, Any] = json.loads(_gmhm.inspect(self.data, "block"))
        return contents

    def _repr_html_(self) -> str:
        contents = self.to_dict()
        sections: list[tuple[str, dict[str, Any]]]
        sections = [(name, values) for name, values in contents.items() if isinstance(values, dict)]
        sections += [(f"term {term.get('kind', '')}", term) for term in contents["terms"]]
        tables = (_html.paragraph(name) + _html.table(("key", "value"), values.items()) for name, values in sections)
        return _html.page(f"Parameter block, {len(self.data)} bytes", *tables)


class Model:
    """A gear or a joint: the contents of a model file. It does not change."""

    __slots__ = ("_native",)

    def __init__(self, native: _gmhm.Model) -> None:
        self._native = native

    @classmethod
    def load(cls, path: Path) -> Model:
        """Reads a model file (TOML). An invalid file raises `ModelError` with line and key."""
        return cls(_gmhm.Model.load(path))

    @classmethod
    def parse(cls, text: str, *, file: str = "model") -> Model:
        """Reads the text of a model file; `file` is its name for messages."""
        return cls(_gmhm.Model.parse(text, file))

    def save(self, path: Path) -> None:
        """Writes the model file; on failure an existing file is not changed."""
        self._native.save(path)

    def to_toml(self) -> str:
        """The text of the model file; reads back to the same model, bit for bit."""
        return self._native.to_toml()

    def to_dict(self) -> dict[str, Any]:
        """The model file as a dict: `name`, `gear`, `elastic`, `memory`, `term`. Its keys name their units."""
        import tomllib

        return tomllib.loads(self.to_toml())

    @property
    def name(self) -> str:
        """Its name for people."""
        return str(self.to_dict()["name"])

    @property
    def torque_unit(self) -> str:
        """`"nm"`, or `"a"` where parameters are per ampere of motor current."""
        return self._native.torque_unit

    @property
    def gear(self) -> dict[str, Any]:
        """Section `[gear]`: ratio, torque side, rated deflection, zero."""
        return dict(self.to_dict()["gear"])

    @property
    def elastic(self) -> dict[str, float] | None:
        """Section `[elastic]`: f(θ) = c1·θ + c2·θ³ + c3·θ⁵; None of a joint log."""
        return self.to_dict().get("elastic")

    @property
    def memory(self) -> dict[str, Any] | None:
        """Section `[memory]`: law, kernel, gate and their parameters; None of a joint log."""
        return self.to_dict().get("memory")

    @property
    def terms(self) -> tuple[Term, ...]:
        """The terms in their order."""
        tables = self.to_dict().get("term", [])
        return tuple(Term(table["kind"], {k: v for k, v in table.items() if k != "kind"}) for table in tables)

    def predict(
        self,
        recording: Source,
        *,
        rated_deflection_rad: float | None = None,
        ratio: float | None = None,
        torque_side: TorqueSide | None = None,
    ) -> Prediction:
        """Predicts the torque of a recording's motion, row by row, as `gmhm predict`.

        The first row is the start: the hysteresis memory is empty there. A torque in the recording is not read.

        Args:
            recording: a recording, path, dict of arrays or frame with `time_s` and a motion (rad), each of shape `(rows,)`.
            rated_deflection_rad: instead of the model's, rad.
            ratio, torque_side: instead of the model's.
        """
        rows = as_recording(recording, "predict", self)
        found = self._native.predict(rows._native, rated_deflection_rad, ratio, torque_side)
        torque, elastic, hysteresis, terms, out_of_range, merged = found
        return Prediction(torque, elastic, hysteresis, dict(terms), out_of_range, merged)

    def invert(self, torque: Source, *, rated_deflection_rad: float | None = None) -> Inversion:
        """Computes the deflection for each torque, in order, as `gmhm invert`.

        Args:
            torque: an array of torques in the unit of the model (N·m, A), shape `(rows,)`; or a recording, path, dict
                of arrays or frame with `torque_nm`, and with `time_s` for law `time` and models with terms.
            rated_deflection_rad: instead of the model's, rad.
        """
        if getattr(torque, "ndim", None) == 1 and getattr(torque.dtype, "names", None) is None:
            torque = {"current_a" if self.torque_unit == "a" else "torque_nm": torque}
        rows = as_recording(torque, "invert", self)
        return Inversion(*self._native.invert(rows._native, rated_deflection_rad))

    def simulate(
        self,
        experiment: str,
        *,
        seed: int = 1,
        duration_s: float | None = None,
        sample_rate_hz: float | None = None,
        amplitudes: Sequence[float] = (),
        rates_hz: Sequence[float] = (),
        cycles: int | None = None,
        waveform: str | None = None,
        speed_rad_per_s: float | None = None,
        warm_up_k: float | None = None,
        hide: Sequence[str] = (),
        noise: str | None = None,
        plant: str | None = None,
        compensation: str | None = None,
    ) -> Simulation:
        """Runs the virtual test bench on the gear, as `gmhm simulate`.

        Args:
            experiment: `cycle`, `amplitudes`, `rates`, `running`, `dynamic`, `drift` or `joint`.
            seed: of every random choice.
            duration_s, sample_rate_hz: s, samples a second.
            amplitudes: shares of the rated deflection (of the rated torque in `running` and `dynamic`), in turn.
            rates_hz: cycles a second, in turn; the upper end of the band where the motion is random.
            cycles, waveform, speed_rad_per_s, warm_up_k, plant, compensation: as the options of `gmhm simulate`.
            hide: physics to hide, each `"KIND=SIZE"` or `"KIND:SHAPE=SIZE"`, SIZE in N·m rms.
            noise: `"none"`, or `"torque=0.1,ar=0.95,encoder_bits=20"`; by default that of a good bench.
        """
        import tomllib

        asked = {key: value for key, value in locals().items() if key not in ("self", "tomllib")}
        asked |= {key: list(asked[key]) for key in ("amplitudes", "rates_hz", "hide")}
        recording, key, truth = self._native.simulate(asked)
        return Simulation(Recording(recording), tomllib.loads(key), Model(truth))

    def pack(
        self,
        *,
        scalar: Literal["f32", "fixed"] = "f32",
        period_s: float | None = None,
        gear: str | None = None,
        stack_depth: int = 16,
        rated_deflection_rad: float | None = None,
    ) -> Block:
        """Makes the parameter block, ready for a drive, as `gmhm pack`.

        Args:
            scalar: arithmetic of the drive.
            period_s: control period, s; required for law `time`.
            gear: gear that the block is for, at most 16 bytes; by default from the model's name.
            stack_depth: turning points that the drive has room for, even, 4 or more.
            rated_deflection_rad: instead of the model's, rad.
        """
        return Block(*self._native.pack(scalar, period_s, gear, stack_depth, rated_deflection_rad))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Model) and self.to_toml() == other.to_toml()

    def __hash__(self) -> int:
        return hash(self.to_toml())

    def __reduce__(self) -> tuple[Any, ...]:
        return Model.parse, (self.to_toml(),)

    def __repr__(self) -> str:
        law = (self.memory or {}).get("law", "no gear")
        terms = "".join(f", {term.kind}" for term in self.terms)
        return f"<gmhm.Model {self.name!r}: {law}{terms}>"

    def _repr_html_(self) -> str:
        contents = self.to_dict()
        sections = [(f"[{name}]", contents[name]) for name in ("gear", "elastic", "memory") if name in contents]
        sections += [(f"[[term]] {term.kind}", term.values) for term in self.terms]
        tables = (_html.paragraph(name) + _html.table(("key", "value"), values.items()) for name, values in sections)
        return _html.page(f"Model {self.name}", *tables)
