"""Recordings from files and from columns in memory."""

from __future__ import annotations

import gc
import pickle
import resource
import threading
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gmhm
import numpy as np
import pandas as pd
import polars as pl
import pytest
from conftest import BENCH, TOP
from numpy.typing import NDArray

Array = NDArray[np.float64]

TIME = np.linspace(0.0, 1.0, 5)
COLUMNS = {"time_s": TIME, "torque_nmm": 1e3 * TIME, "deflection_mrad": TIME, "remark": np.array(list("abcde"))}


def test_columns_are_views_that_cannot_be_written() -> None:
    recording = gmhm.read(BENCH / "cycle.csv")
    column = recording.torque_nm
    assert column.shape == (len(recording),)
    assert np.shares_memory(column, recording["torque_nm"])
    with pytest.raises(ValueError, match="read-only"):
        column[0] = 1.0
    del recording
    assert np.isfinite(column).all()


def gear_arrays(rows: int = 4000) -> dict[str, Array]:
    """A gear without hysteresis, with noise: columns in the units of a recording."""
    time_s = 1e-2 * np.arange(rows)
    deflection_rad = 1.168e-3 * np.sin(0.5 * time_s)
    torque_nm = 2.5e4 * deflection_rad + np.random.default_rng(1).normal(0.0, 0.1, rows)
    return {"time_s": time_s, "deflection_rad": deflection_rad, "torque_nm": torque_nm}


@pytest.mark.parametrize("frame", [dict, pd.DataFrame, pl.DataFrame], ids=["dict", "pandas", "polars"])
def test_contiguous_doubles_are_read_where_they_lie(frame: Callable[[dict[str, Array]], Any]) -> None:
    source = frame(gear_arrays())
    recording = gmhm.read(source, from_s=1.0)
    for name in recording.columns:
        column = source[name] if frame is dict else source[name].to_numpy()
        assert np.shares_memory(recording[name], column), name
        np.testing.assert_array_equal(recording[name], column[100:])
    assert np.shares_memory(gmhm.read(recording, to_s=2.0).torque_nm, recording.torque_nm)


def test_other_arrays_are_converted_and_copies_are_private() -> None:
    columns = gear_arrays()
    singles = {name: column.astype(np.float32) for name, column in columns.items()}
    swapped = {name: column.astype(">f8") for name, column in columns.items()}
    strided = {name: np.repeat(column, 2)[::2] for name, column in columns.items()}
    for source in (singles, swapped, strided):
        recording = gmhm.read(source)
        assert not any(np.shares_memory(recording[name], source[name]) for name in source)
        np.testing.assert_array_equal(recording.torque_nm, source["torque_nm"].astype(float))
    # A unit of its own, or a map that scales, converts a column; the others stay where they are.
    scaled = gmhm.read(columns, map={"torque_nm": "torque_nm*2"})
    np.testing.assert_array_equal(scaled.torque_nm, 2 * columns["torque_nm"])
    assert np.shares_memory(scaled.time_s, columns["time_s"])
    shared = gmhm.read(columns)
    for private in (gmhm.read(shared, copy=True), gmhm.read(columns, copy=True)):
        assert not any(np.shares_memory(private[name], columns[name]) for name in columns)
    expected = columns["torque_nm"].copy()
    columns["torque_nm"][:] = np.nan
    np.testing.assert_array_equal(private.torque_nm, expected)
    assert gmhm.fit(private, rated_deflection_rad=1.168e-3, compare=False).rows == len(private)


def test_work_leaves_arrays_as_they_are_and_copies_only_what_it_changes() -> None:
    columns = gear_arrays()
    columns["deflection_rad"][777] += 1e-3
    before = {name: column.copy() for name, column in columns.items()}
    recording = gmhm.read(columns)
    with pytest.warns(gmhm.Note, match="dropouts"):
        fit = gmhm.fit(recording, rated_deflection_rad=1.168e-3, compare=False)
    with pytest.warns(gmhm.Note, match="dropouts"):
        gmhm.diagnose(recording, fit.model)
    with pytest.warns(gmhm.Note, match="dropouts"):
        gmhm.health([recording, recording])
    fit.model.predict(recording)
    for name, column in columns.items():
        assert column.flags.writeable
        np.testing.assert_array_equal(column, before[name])
        assert np.shares_memory(fit.recordings[0][name], column) == (name != "deflection_rad")
    assert fit.recordings[0].deflection_rad[777] != columns["deflection_rad"][777]


def test_arrays_live_as_long_as_their_recording() -> None:
    columns = gear_arrays()
    expected, ends = columns["torque_nm"].copy(), weakref.ref(columns["torque_nm"])
    recording = gmhm.read(columns)
    column = recording.torque_nm
    del columns
    gc.collect()
    assert ends() is not None
    del recording
    gc.collect()
    np.testing.assert_array_equal(column, expected)
    del column
    gc.collect()
    assert ends() is None


def test_an_array_that_was_written_to_is_found_out() -> None:
    columns = gear_arrays()
    recording = gmhm.read(columns, name="bench")
    model = gmhm.fit(recording, rated_deflection_rad=1.168e-3, compare=False).model
    columns["torque_nm"][[5, 9]] *= -1.0
    uses: list[Callable[[], object]] = [
        lambda: gmhm.fit(recording),
        lambda: gmhm.diagnose(recording, model),
        lambda: gmhm.health([recording, recording]),
        lambda: model.predict(recording),
        lambda: model.invert(recording),
    ]
    for use in uses:
        with pytest.raises(gmhm.RecordingError, match="the array of `torque_nm` was written to") as caught:
            use()
        assert (caught.value.file, caught.value.field) == ("bench", "torque_nm")
    columns["torque_nm"][[5, 9]] *= -1.0
    assert gmhm.fit(recording, rated_deflection_rad=1.168e-3, compare=False).rows == len(recording)


def test_an_array_that_is_written_to_during_a_fit_is_found_out() -> None:
    columns, done = gear_arrays(40_000), threading.Event()

    def write() -> None:
        while not done.wait(0.01):
            columns["torque_nm"][20_000] += 1e-9

    thread = threading.Thread(target=write)
    thread.start()
    with pytest.raises(gmhm.RecordingError, match="the array of `torque_nm` was written to"):
        gmhm.fit(columns, rated_deflection_rad=1.168e-3, compare=False)
    done.set()
    thread.join()


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is asked of Linux")
def test_ten_million_rows_take_no_memory_of_their_own() -> None:
    def held() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()

    columns = gear_arrays(10_000_000)
    before = held()
    recording = gmhm.read(columns)
    assert held() - before < recording.time_s.nbytes / 10


@pytest.mark.parametrize(
    "source",
    [
        COLUMNS,
        pd.DataFrame(COLUMNS),
        pl.DataFrame(COLUMNS),
        np.array(list(zip(*COLUMNS.values(), strict=True)), [(name, column.dtype) for name, column in COLUMNS.items()]),
        {name: list(column) for name, column in COLUMNS.items()},
        {name: column[::-1][::-1] for name, column in COLUMNS.items()},
    ],
    ids=["dict", "pandas", "polars", "structured", "lists", "strided"],
)
def test_columns_in_memory_are_read_by_name_and_unit(source: object) -> None:
    recording = gmhm.read(source)
    assert recording.columns == ("time_s", "deflection_rad", "torque_nm")
    np.testing.assert_allclose(recording.torque_nm, TIME, rtol=1e-15)
    np.testing.assert_allclose(recording.deflection_rad, 1e-3 * TIME, rtol=1e-15)


def test_a_file_and_its_frame_are_equal() -> None:
    file = gmhm.read(BENCH / "running.csv")
    frame = gmhm.read(pl.read_csv(BENCH / "running.csv"))
    assert file.columns == frame.columns
    for name in file.columns:
        np.testing.assert_array_equal(file[name], frame[name])
    assert len(file.sha256) == 64 and frame.sha256 == ""


def test_files_of_matlab_7_3_are_read() -> None:
    folder = TOP / "tools" / "tests" / "recordings"
    recording, expected = gmhm.read(folder / "h5py_73.mat"), gmhm.read(folder / "expected.csv")
    np.testing.assert_array_equal(recording.torque_nm, expected.torque_nm)


def test_columns_are_mapped_and_rows_cropped() -> None:
    columns = {"t": TIME, "tau": TIME, "x": TIME}
    map = {"time_s": "t", "torque_nm": "tau*2", "deflection_rad": "-x"}
    recording = gmhm.read(columns, map=map, from_s=0.2, to_s=0.8)
    np.testing.assert_array_equal(recording.torque_nm, 2 * TIME[1:4])
    np.testing.assert_array_equal(recording.deflection_rad, -TIME[1:4])
    assert gmhm.read(columns, map="time_s=t,torque_nm=tau,deflection_rad=x").columns[0] == "time_s"


def test_what_is_wrong_is_said_with_its_place() -> None:
    broken = TIME.copy()
    broken[3] = np.nan
    with pytest.raises(gmhm.RecordingError) as caught:
        gmhm.read(COLUMNS | {"torque_nmm": broken}, name="bench")
    error = caught.value
    assert (error.file, error.row, error.line, error.field) == ("bench", 4, None, "torque_nmm")
    assert str(error) == (
        "bench, row 4, column 2 `torque_nmm`: `NaN` is not a finite number\n"
        "help: remove the row, or fill it by a measured value"
    )
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
    with pytest.raises(gmhm.RecordingError, match="`torque_nm`: holds text or other objects, not numbers"):
        gmhm.read({"time_s": TIME, "torque_nm": COLUMNS["remark"]})
    with pytest.raises(gmhm.RecordingError, match="has 4 rows, `time_s` has 5"):
        gmhm.read({"time_s": TIME, "torque_nm": TIME[1:]})
    with pytest.raises(gmhm.RecordingError, match=r"has no column `torque_nm` \(or `current_a`\)") as caught:
        gmhm.fit({"time_s": TIME, "deflection_rad": TIME})
    with pytest.raises(gmhm.OptionError, match="map: `torque_nm` is no mapping"):
        gmhm.read(COLUMNS, map="torque_nm")
    with pytest.raises(TypeError, match="int is no recording"):
        gmhm.read(3)


def test_a_file_is_refused_in_the_words_of_the_command_line(tmp_path: Path) -> None:
    path = tmp_path / "rec.csv"
    path.write_text("time_s,torque_nm,deflection_rad\n0,1,2\n1,x,3\n")
    with pytest.raises(gmhm.RecordingError) as caught:
        gmhm.read(path)
    assert (caught.value.line, caught.value.field) == (3, "torque_nm")
    assert caught.value.message == f"{path}, line 3, column 2 `torque_nm`: `x` is not a number"
    with pytest.raises(gmhm.RecordingError, match="cannot be read: No such file"):
        gmhm.read(tmp_path / "none.csv")


def test_recordings_are_pickled() -> None:
    recording = gmhm.read(COLUMNS, name="bench")
    copy = pickle.loads(pickle.dumps(recording))
    assert (copy.name, copy.columns) == ("bench", recording.columns)
    np.testing.assert_array_equal(copy.torque, recording.torque)
    assert "bench" in recording._repr_html_()
