"""Identification, beside the command line and SciPy."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import gmhm
import numpy as np
import pytest
from conftest import BENCH, Run
from scipy.optimize import least_squares


def test_numbers_are_those_of_the_command_line(tmp_path: Path, program: Run) -> None:
    files = [BENCH / "cycle.csv", BENCH / "amplitudes.csv"]
    model, table = tmp_path / "gear.toml", tmp_path / "fit.json"
    program("fit", *files, "--rated-deflection", 1.168e-3, "--ratio", 100, "-o", model, "--json", table)
    fit = gmhm.fit(files, rated_deflection_rad=1.168e-3, ratio=100)
    assert fit.to_dict() == json.loads(table.read_text())
    assert fit.model == gmhm.Model.load(model)


def test_each_recording_has_a_zero_of_its_own(tmp_path: Path, program: Run) -> None:
    files, table = [BENCH / "cycle.csv", BENCH / "amplitudes.csv"], tmp_path / "fit.json"
    program("fit", *files, "--rated-deflection", 1.168e-3, "--own-zeros", "-o", tmp_path / "gear.toml", "--json", table)
    fit = gmhm.fit(files, rated_deflection_rad=1.168e-3, own_zeros=True)
    assert fit.to_dict() == json.loads(table.read_text())
    assert all(zero.sd_rad is not None for zero in fit.deflection_zeros)
    health = gmhm.health(files, rated_deflection_rad=1.168e-3, own_zeros=True)
    program("health", *files, "--rated-deflection", 1.168e-3, "--own-zeros", "--json", table)
    assert health.to_dict() == json.loads(table.read_text())


def test_results_read_back(fitted: gmhm.Fit) -> None:
    beside = {name: getattr(fitted, name) for name in ("model", "recordings", "residuals", "predictions")}
    assert gmhm.Fit.from_dict(fitted.to_dict(), **beside) == fitted
    copy = pickle.loads(pickle.dumps(fitted))
    assert copy.to_dict() == fitted.to_dict()
    np.testing.assert_array_equal(copy.residuals[0], fitted.residuals[0])


def test_arrays_are_beside_the_numbers(fitted: gmhm.Fit, cycle: gmhm.Recording) -> None:
    (residual,), (prediction,), (recording,) = fitted.residuals, fitted.predictions, fitted.recordings
    assert residual.shape == prediction.shape == cycle.torque_nm.shape
    predicted = fitted.model.predict(recording).torque
    np.testing.assert_array_equal(prediction, predicted)
    left = np.std(cycle.torque_nm - predicted)
    assert left == pytest.approx(fitted.rms, rel=0.2)
    assert fitted.parameter("c1_nm_per_rad").value == fitted.model.to_dict()["elastic"]["c1_nm_per_rad"]
    with pytest.raises(KeyError, match="the parameters are"):
        fitted.parameter("none")
    assert fitted.verdict.sentence in fitted._repr_html_()


def test_scipy_finds_the_same_optimum() -> None:
    recording = gmhm.demo()
    fit = gmhm.fit(recording, rated_deflection_rad=1.168e-3, compare=False)
    base = fit.model.to_dict()
    names = [("elastic", "c1_nm_per_rad"), ("elastic", "c2_nm_per_rad3"), ("elastic", "c3_nm_per_rad5"), ("memory", "alpha"), ("memory", "beta_per_s")]
    start = np.array([base[section][key] for section, key in names])

    def model_of(scaled: np.ndarray) -> gmhm.Model:
        text = fit.model.to_toml()
        for (section, key), old, value in zip(names, start, scaled * start, strict=True):
            text = text.replace(f"{key} = {base[section][key]!r}".replace("e+", "e"), f"{key} = {float(value)!r}")
        return gmhm.Model.parse(text)

    def residual(scaled: np.ndarray) -> Any:
        left = recording.torque_nm - model_of(scaled).predict(recording).torque
        return left - left.mean()

    ours = np.sqrt(np.mean(residual(np.ones(5)) ** 2))
    theirs = least_squares(residual, np.ones(5), x_scale=0.01)
    assert np.sqrt(np.mean(theirs.fun**2)) == pytest.approx(ours, rel=1e-3)
    sd = np.array([fit.parameter(name).sd or np.inf for name in ("c1_nm_per_rad", "c2_nm_per_rad3", "c3_nm_per_rad5")])
    assert (np.abs(theirs.x - 1)[:3] * np.abs(start[:3]) < sd).all()


def test_a_fit_without_comparison_says_the_same_of_the_gear(fitted: gmhm.Fit, cycle: gmhm.Recording) -> None:
    alone = gmhm.fit(cycle, rated_deflection_rad=1.168e-3, compare=False)
    assert alone.parameters == fitted.parameters
    assert alone.comparison == ()


def test_options_are_checked(cycle: gmhm.Recording) -> None:
    with pytest.raises(gmhm.OptionError, match="rated_deflection_rad: must be a number greater than zero"):
        gmhm.fit(cycle, rated_deflection_rad=-1.0)
    with pytest.raises(gmhm.OptionError, match='torque_side: "left" is none of motor, output'):
        gmhm.fit(cycle, torque_side="left")  # type: ignore[arg-type]
    with pytest.raises(gmhm.FitError, match="rows are too few") as caught:
        gmhm.fit({name: column[:10] for name, column in cycle.to_dict().items()})
    assert caught.value.help == "record for longer, or at a higher rate"
    with pytest.warns(gmhm.Note, match="same"):
        gmhm.fit([cycle, cycle], rated_deflection_rad=1.168e-3, compare=False)
