"""Diagnosis and health, beside the command line."""

from __future__ import annotations

import json
from pathlib import Path

import gmhm
import pytest
from conftest import BENCH, Run


@pytest.fixture(scope="module")
def found(gear: gmhm.Model) -> gmhm.Diagnosis:
    return gmhm.diagnose(BENCH / "running.csv", gear)


def test_findings_are_those_of_the_command_line(found: gmhm.Diagnosis, tmp_path: Path, program: Run) -> None:
    model, table = tmp_path / "extended.toml", tmp_path / "found.json"
    program("diagnose", BENCH / "true_gear.toml", BENCH / "running.csv", "-o", model, "--json", table)
    assert found.to_dict() == json.loads(table.read_text())
    assert found.model == gmhm.Model.load(model)


def test_effects_are_terms_of_the_extended_model(found: gmhm.Diagnosis) -> None:
    assert found.mismatch and found.rms.extended < 0.2 * found.rms.given
    assert [effect.name for effect in found.effects] == [term.kind for term in found.model.terms]
    assert found.heldout.from_ == "blocks"
    assert gmhm.Diagnosis.from_dict(found.to_dict(), model=found.model) == found
    assert found.effects[0].name in found._repr_html_()
    assert "No structure" in gmhm.diagnose(BENCH / "running.csv", found.model)._repr_html_()


def test_another_simulators_torque_is_the_base_without_a_model(gear: gmhm.Model) -> None:
    recording = gmhm.read(BENCH / "running.csv")
    columns = recording.to_dict() | {"torque_sim_nm": gear.predict(recording).torque}
    found = gmhm.diagnose(columns)
    assert found.mismatch and found.model.gear["base"] == "simulation"
    with pytest.raises(gmhm.DiagnoseError):
        gmhm.diagnose([columns, recording])


def test_health_is_that_of_the_command_line(tmp_path: Path, program: Run) -> None:
    files = [BENCH / "cycle.csv", BENCH / "amplitudes.csv"]
    for words, recordings in ((files, files), (files[:1], files[0])):
        table = tmp_path / "health.json"
        program("health", *words, "--json", table)
        health = gmhm.health(recordings)
        assert health.to_dict() == json.loads(table.read_text())
        assert gmhm.Health.from_dict(health.to_dict()) == health
        assert "K1" in health._repr_html_()


def test_health_of_models(gear: gmhm.Model, tmp_path: Path) -> None:
    paths = [tmp_path / "a.toml", tmp_path / "b.toml"]
    gear.save(paths[0])
    gmhm.Model.parse(gear.to_toml().replace('name = "', 'name = "other ')).save(paths[1])
    health = gmhm.health(models=paths)
    assert all(change.change == 0.0 for change in health.changes)
    with pytest.raises(TypeError, match="not both"):
        gmhm.health(BENCH / "cycle.csv", models=paths)
    with pytest.raises(gmhm.HealthError, match="no recording and no model given"):
        gmhm.health()
