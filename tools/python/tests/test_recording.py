"""Recordings from files and from columns in memory."""

from __future__ import annotations

import pickle
from pathlib import Path

import gmhm
import numpy as np
import pandas as pd
import polars as pl
import pytest
from conftest import BENCH, TOP

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


def test_a_recording_owns_its_rows() -> None:
    columns = {name: column.copy() for name, column in COLUMNS.items() if name != "remark"}
    recording = gmhm.read(columns)
    for column in columns.values():
        column[:] = np.nan
    np.testing.assert_array_equal(recording.time_s, TIME)
    np.testing.assert_allclose(recording.torque_nm, TIME, rtol=1e-15)


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
