"""Models: files, prediction, inversion, simulation."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import gmhm
import numpy as np
import pytest
from conftest import BENCH, Run
from scipy.optimize import brentq


def test_files_read_back(gear: gmhm.Model, tmp_path: Path) -> None:
    gear.save(tmp_path / "gear.toml")
    assert gmhm.Model.load(tmp_path / "gear.toml") == gear == pickle.loads(pickle.dumps(gear))
    assert hash(gear) == hash(gmhm.Model.parse(gear.to_toml()))
    assert gear.gear["rated_deflection_rad"] == 1.168e-3
    assert gear.elastic is not None and gear.memory is not None
    assert gear.elastic["c1_nm_per_rad"] == gear.to_dict()["elastic"]["c1_nm_per_rad"]
    assert gear.memory["law"] == "masing" in repr(gear)
    assert "c1_nm_per_rad" in gear._repr_html_()
    with pytest.raises(gmhm.OutputError, match="does not exist"):
        gear.save(tmp_path / "none" / "gear.toml")


def test_a_model_file_is_refused_with_line_and_key(gear: gmhm.Model) -> None:
    with pytest.raises(gmhm.ModelError) as caught:
        gmhm.Model.parse(gear.to_toml().replace("c1_nm_per_rad", "c1_nm_per_deg"), file="gear.toml")
    assert caught.value.line is not None and caught.value.file == "gear.toml"
    assert "did you mean `c1_nm_per_rad`" in caught.value.message
    assert (caught.value.help or "").startswith("known: ")


def test_terms_are_named() -> None:
    model = gmhm.Model.load(Path(__file__).parents[2] / "tests" / "exported" / "gear_with_terms.toml")
    kinds = [term.kind for term in model.terms]
    assert len(kinds) > 1
    prediction = model.predict(BENCH / "running.csv")
    assert list(prediction.terms) == kinds
    total = prediction.elastic + prediction.hysteresis + sum(prediction.terms.values())
    np.testing.assert_allclose(prediction.torque, total, atol=1e-12)


def test_predictions_are_those_of_the_command_line(gear: gmhm.Model, tmp_path: Path, program: Run) -> None:
    output = tmp_path / "out.csv"
    program("predict", BENCH / "true_gear.toml", BENCH / "amplitudes.csv", "-o", output)
    table = np.genfromtxt(output, delimiter=",", names=True)
    prediction = gear.predict(BENCH / "amplitudes.csv")
    np.testing.assert_array_equal(prediction.torque, table["torque_model_nm"])
    np.testing.assert_array_equal(prediction.hysteresis, table["hysteresis_nm"])
    again = gear.predict({name: table[name] for name in ("time_s", "deflection_rad")})
    np.testing.assert_array_equal(again.torque, prediction.torque)


def test_inversion_is_the_root_that_scipy_finds(gear: gmhm.Model) -> None:
    torque = np.array([3.0, 12.0, -7.0, 20.0])
    inversion = gear.invert(torque)
    assert not inversion.saturated.any()
    for row, expected in enumerate(torque):
        path = inversion.deflection_rad[:row]

        def excess(theta: float) -> float:
            # A recording has two rows at least.
            deflection = np.array([*path, theta, theta])
            rows = {"time_s": np.arange(len(deflection), dtype=float), "deflection_rad": deflection}
            return float(gear.predict(rows).torque[row] - expected)

        root = brentq(excess, -1.168e-3, 1.168e-3, xtol=1e-15)
        assert inversion.deflection_rad[row] == pytest.approx(root, abs=1e-9)


def test_no_array_that_is_handed_out_is_a_copy(gear: gmhm.Model, fitted: gmhm.Fit, cycle: gmhm.Recording) -> None:
    prediction, inversion = gear.predict(cycle), gear.invert(cycle.torque_nm[:100])
    arrays = [prediction.torque, prediction.elastic, prediction.hysteresis, inversion.deflection_rad, inversion.saturated]
    arrays += [*fitted.residuals, *fitted.predictions, *cycle.to_dict().values(), *fitted.recordings[0].to_dict().values()]
    assert prediction.to_dict()["torque"] is prediction.torque
    # Of a copy NumPy owns the numbers; these the library made, and an array looks at them.
    assert not any(array.flags.owndata for array in arrays)


def test_notebooks_show_every_result_as_a_table(gear: gmhm.Model, fitted: gmhm.Fit, cycle: gmhm.Recording) -> None:
    prediction, inversion = gear.predict(cycle), gear.invert(cycle.torque_nm[:100])
    simulation = gear.simulate("cycle")
    results: list[tuple[Any, str]] = [
        (prediction, f"{prediction.elastic.min():.6g}, {prediction.elastic.max():.6g}"),
        (inversion, f"{inversion.range_rad:.6g}"),
        (simulation, "recording: torque_nm"),
        (fitted.parameters[0], fitted.parameters[0].unit),
        (fitted.verdict, fitted.verdict.sentence),
    ]
    for result, shown in results:
        page = result._repr_html_()
        assert "<table>" in page and shown in page


def test_torques_beyond_the_range_are_a_note(gear: gmhm.Model) -> None:
    with pytest.warns(gmhm.Note, match="1 of 2 torques lie beyond the range of the model"):
        inversion = gear.invert(np.array([1.0, 1e4]))
    assert inversion.saturated.tolist() == [False, True]


def test_the_bench_is_that_of_the_command_line(gear: gmhm.Model, tmp_path: Path, program: Run) -> None:
    output, words = tmp_path / "out.csv", ("--noise", "torque=0.1", "--hide", "wear:step=0.1", "--seed", 7)
    program("simulate", BENCH / "true_gear.toml", "--experiment", "running", "-o", output, *words)
    simulation = gear.simulate("running", noise="torque=0.1", hide=["wear:step=0.1"], seed=7)
    np.testing.assert_array_equal(simulation.recording.torque, gmhm.read(output).torque)
    assert [hidden["kind"] for hidden in simulation.key["hidden"]] == ["wear"]
    assert [term.kind for term in simulation.truth.terms] == ["wear"]
    assert simulation.to_dict()["truth"] == simulation.truth.to_dict()
    assert simulation.truth.terms[0].to_dict()["kind"] == "wear"
    with pytest.raises(gmhm.OptionError, match='experiment: "walk" is none of cycle'):
        gear.simulate("walk")
    with pytest.raises(gmhm.SimulateError, match="--duration"):
        gear.simulate("cycle", duration_s=-1.0)


def test_blocks_are_those_of_the_command_line(gear: gmhm.Model, tmp_path: Path, program: Run) -> None:
    output = tmp_path / "params.bin"
    program("pack", BENCH / "true_gear.toml", "-o", output)
    block = gear.pack()
    assert block.data == output.read_bytes() == gmhm.Block.load(output).data
    block.save(tmp_path / "params.hex")
    assert gmhm.Block.load(tmp_path / "params.hex").data == block.data
    assert block.to_dict()["block"]["scalar"] == "f32"
    assert "crc32" in block._repr_html_()
    with pytest.raises(gmhm.BlockError, match="a block is written as .bin, .hex"):
        block.save(tmp_path / "params.txt")
