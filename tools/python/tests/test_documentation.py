"""The example of the documentation runs."""

from __future__ import annotations

import re
from pathlib import Path

import gmhm
import pytest
from conftest import TOP


def test_the_example_of_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "examples").symlink_to(TOP / "examples")
    monkeypatch.chdir(tmp_path)
    (example,) = re.findall(r"```python\n(.*?)```", (TOP / "docs" / "python.md").read_text(), re.DOTALL)
    exec(compile(example, "docs/python.md", "exec"), {})
    assert gmhm.Block.load("params.bin").to_dict()["block"]["period_s"] == pytest.approx(1e-4)


def test_every_public_name_has_a_docstring() -> None:
    assert [name for name in gmhm.__all__ if not getattr(gmhm, name).__doc__] == []
