from collections.abc import Callable
from os import PathLike
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Model",
    "Recording",
    "demo",
    "diagnose",
    "fit",
    "health_of_models",
    "health_of_recordings",
    "inspect",
    "read_block",
    "read_columns",
    "read_file",
    "write_block",
]

_Array = NDArray[np.float64]
_Path = str | PathLike[str]

@final
class Recording:
    @property
    def name(self) -> str: ...
    @property
    def sha256(self) -> str: ...
    @property
    def torque_unit(self) -> str: ...
    @property
    def columns(self) -> list[str]: ...
    def __len__(self) -> int: ...
    def column(self, name: str) -> _Array | None: ...
    def require(self, purpose: str, model: Model | None = None) -> None: ...

@final
class Model:
    @staticmethod
    def parse(text: str, file: str) -> Model: ...
    @staticmethod
    def load(path: _Path) -> Model: ...
    @property
    def torque_unit(self) -> str: ...
    def to_toml(self) -> str: ...
    def save(self, path: _Path) -> None: ...
    def predict(
        self,
        recording: Recording,
        rated_deflection_rad: float | None = None,
        ratio: float | None = None,
        torque_side: str | None = None,
    ) -> tuple[_Array, _Array, _Array, list[tuple[str, _Array]], int, int]: ...
    def invert(
        self, recording: Recording, rated_deflection_rad: float | None = None
    ) -> tuple[_Array, NDArray[np.bool_], float, int]: ...
    def simulate(self, asked: dict[str, Any]) -> tuple[Recording, str, Model]: ...
    def pack(
        self,
        scalar: str,
        period_s: float | None = None,
        gear: str | None = None,
        stack_depth: int = 16,
        rated_deflection_rad: float | None = None,
    ) -> tuple[bytes, str | None]: ...

def read_file(
    path: _Path,
    purpose: str,
    model: Model | None = None,
    map: str | None = None,
    from_s: float | None = None,
    to_s: float | None = None,
) -> Recording: ...
def read_columns(
    name: str,
    names: list[str],
    column: Callable[[int], _Array],
    purpose: str,
    model: Model | None = None,
    map: str | None = None,
    from_s: float | None = None,
    to_s: float | None = None,
) -> Recording: ...
def demo(seed: int) -> Recording: ...
def fit(
    recordings: list[Recording],
    model: Model | None,
    method: str,
    own_zeros: bool,
    rated_deflection_rad: float | None,
    ratio: float | None,
    torque_side: str | None,
    name: str | None,
    seed: int,
    compare: bool,
) -> tuple[str, Model, list[Recording], list[_Array], list[_Array]]: ...
def diagnose(
    recordings: list[Recording],
    model: Model | None,
    holdout: list[Recording],
    own_zeros: bool,
    rated_deflection_rad: float | None,
    ratio: float | None,
    torque_side: str | None,
    name: str | None,
    seed: int,
) -> tuple[str, Model]: ...
def health_of_recordings(
    recordings: list[Recording],
    model: Model | None,
    own_zeros: bool,
    rated_deflection_rad: float | None,
    ratio: float | None,
    torque_side: str | None,
    rating: list[float | None],
    against: str | None,
    seed: int,
) -> str: ...
def health_of_models(
    models: list[_Path], rating: list[float | None], against: str | None, seed: int
) -> str: ...
def inspect(bytes: bytes, name: str) -> str: ...
def read_block(path: _Path) -> bytes: ...
def write_block(bytes: bytes, path: _Path, address: int) -> None: ...
