"""Recordings: from files, and from columns in memory."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias, TypeGuard, cast

from . import _gmhm, _html

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ._model import Model

    Array: TypeAlias = NDArray[np.float64]
else:
    # NumPy is imported when the first array is made.
    Array = Any

#: What is read as a recording: a `Recording`; a path; columns by name, as a dict of arrays, a frame of pandas or
#: polars, a table of PyArrow, or a structured array.
Source: TypeAlias = Any

#: Columns under other names, as text `"torque_nm=tau*0.001,time_s=t"` or as a dict `{"torque_nm": "tau*0.001"}`.
Map: TypeAlias = str | Mapping[str, str] | None


class Recording:
    """Rows of one recording in SI units, every number finite, time increasing.

    The columns are attributes, each a view of shape `(rows,)` that cannot be written to:
    `time_s` (s), `torque_nm` (N·m) or `current_a` (A), `deflection_rad`, `theta_in_rad`, `theta_out_rad` (rad),
    `velocity_out_rad_per_s` (rad/s), `temperature_c` (°C), `torque_sim_nm` (N·m). A column that was not
    recorded raises `AttributeError`.
    """

    __slots__ = ("_native",)

    def __init__(self, native: _gmhm.Recording) -> None:
        self._native = native

    @property
    def name(self) -> str:
        """Where it came from, for messages and reports."""
        return self._native.name

    @property
    def sha256(self) -> str:
        """SHA-256 of the file in hexadecimal; empty for columns in memory."""
        return self._native.sha256

    @property
    def torque_unit(self) -> str:
        """`"nm"`, or `"a"` where a motor current replaces the torque."""
        return self._native.torque_unit

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of the columns that are there, time first."""
        return tuple(self._native.columns)

    def __len__(self) -> int:
        return len(self._native)

    def __getitem__(self, name: str) -> Array:
        column = self._native.column(name)
        if column is None:
            raise KeyError(name)
        return column

    def __getattr__(self, name: str) -> Array:
        if not name.startswith("_") and (column := self._native.column(name)) is not None:
            return column
        raise AttributeError(f"{type(self).__name__} has no {name}; its columns are {', '.join(self.columns)}")

    def __dir__(self) -> Iterable[str]:
        return [*super().__dir__(), *self.columns]

    @property
    def torque(self) -> Array:
        """The torque, N·m, or the current that replaces it, A; shape `(rows,)`."""
        return self["current_a" if self.torque_unit == "a" else "torque_nm"]

    def to_dict(self) -> dict[str, Array]:
        """The columns by name: `pandas.DataFrame(recording.to_dict())`."""
        return {name: self[name] for name in self.columns}

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self.name, self.to_dict())

    def __repr__(self) -> str:
        return f"<gmhm.Recording {self.name!r}: {len(self)} rows of {', '.join(self.columns)}>"

    def _repr_html_(self) -> str:
        rows = [(name, f"{column.min():.6g}", f"{column.max():.6g}") for name, column in self.to_dict().items()]
        heading = f"{self.name}: {len(self)} rows"
        return _html.page(heading, _html.table(("column", "lowest", "highest"), rows))


def _restored(name: str, columns: dict[str, Array]) -> Recording:
    return read(columns, name=name)


def read(
    source: Source,
    *,
    map: Map = None,
    from_s: float | None = None,
    to_s: float | None = None,
    name: str | None = None,
    copy: bool = False,
) -> Recording:
    """Reads a recording.

    Args:
        source: a file (CSV, also `.gz` and `.zst`, Parquet, MAT, MDF4, MCAP), or columns in memory: a dict of
            arrays, a frame of pandas or polars, a table of PyArrow, a structured array. Columns are recognised by
            their names, as those of files (`torque_nm`, `deflection_mrad`, `Time [s]`).
        map: columns under other names, scaled, flipped or shifted: `"torque_nm=tau*0.001,deflection_rad=-x"`.
        from_s, to_s: rows before and after these times are ignored, s of the time column.
        name: for messages and reports, of columns in memory.
        copy: the recording gets its own rows. Otherwise it reads columns that are contiguous arrays of float64 in SI
            units, shape `(rows,)`, where they lie: do not write to them while the recording is in use. What is done with
            a recording whose arrays were written to raises `RecordingError`. All other columns are converted, which
            leaves the arrays as they are.

    Raises:
        RecordingError: the first fault, with file, line or row, and column.
    """
    return as_recording(source, "any", map=map, from_s=from_s, to_s=to_s, name=name, copy=copy)


def demo(seed: int = 1) -> Recording:
    """The built-in recording of `gmhm demo`: synthetic, the published gear with white noise on its torque.

    Returns:
        3001 rows of `time_s`, `deflection_rad` and `torque_nm`, at 100 Hz.
    """
    return Recording(_gmhm.demo(seed))


def as_recording(
    source: Source,
    purpose: str,
    model: Model | None = None,
    *,
    map: Map = None,
    from_s: float | None = None,
    to_s: float | None = None,
    name: str | None = None,
    copy: bool = False,
) -> Recording:
    """A source as a recording that has what is needed for a purpose, of which others are given by its name."""
    native = None if model is None else model._native
    text = ",".join(f"{key}={value}" for key, value in map.items()) if isinstance(map, Mapping) else map
    if isinstance(source, Recording):
        source._native.require(purpose, native)
        if not copy and all(option is None for option in (text, from_s, to_s, name)):
            return source
        source, name = source.to_dict(), name or source.name
    if isinstance(source, (str, os.PathLike)):
        return Recording(_gmhm.read_file(cast("str | os.PathLike[str]", source), purpose, native, text, from_s, to_s))
    names, column = _columns(source, copy)
    if name is None:
        name = "recording"
    return Recording(_gmhm.read_columns(name, names, column, purpose, native, text, from_s, to_s))


def as_recordings(sources: Source, purpose: str, model: Model | None = None) -> list[_gmhm.Recording]:
    """One source or several as recordings."""
    several = isinstance(sources, Sequence) and not isinstance(sources, (str, Recording))
    listed = cast("Sequence[Any]", sources if several else [sources])
    return [as_recording(source, purpose, model)._native for source in listed]


def _columns(source: Any, copy: bool) -> tuple[list[str], Callable[[int], Array]]:
    """The names of columns in memory, and the function that gives the numbers of each."""
    labels: list[Any]
    if _is_mapping(source):
        labels = list(source)
    elif (names := getattr(getattr(source, "dtype", None), "names", None)) is not None:
        labels = list(names)
    elif hasattr(source, "column_names"):
        labels = list(source.column_names)
    elif hasattr(source, "columns"):
        labels = list(source.columns)
    else:
        raise TypeError(
            f"{type(source).__name__} is no recording: give a path, a dict of arrays, a frame of pandas or polars, "
            "a table of PyArrow or a structured array"
        )
    return [str(label) for label in labels], lambda index: _numbers(source[labels[index]], copy)


def _is_mapping(source: Any) -> TypeGuard[Mapping[Any, Any]]:
    return isinstance(source, Mapping)


def _numbers(column: Any, copy: bool) -> Array:
    """A column as contiguous floats, without a copy if it has this form; an exception names any other content."""
    import numpy as np

    array = np.asarray(column.to_numpy() if hasattr(column, "to_numpy") else column)
    if array.ndim != 1:
        raise TypeError(f"an array of shape {array.shape}")
    if array.dtype.kind in "mM":
        raise TypeError("dates or durations")
    if array.dtype.kind not in "fiub":
        try:
            array = array.astype(np.float64)
        except (TypeError, ValueError):
            raise TypeError("text or other objects") from None
    if copy:
        return np.array(array, np.float64, order="C")
    return np.require(array, np.float64, ["C", "A"])
