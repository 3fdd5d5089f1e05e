"""What the tests share."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import gmhm
import pytest

TOP = Path(__file__).parents[3]
BENCH = TOP / "examples" / "bench"

Run = Callable[..., None]


@pytest.fixture(scope="session")
def program() -> Run:
    """The command line, to compare with; its path is in GMHM."""
    path = os.environ["GMHM"]

    def run(*words: object) -> None:
        subprocess.run([path, "--quiet", *map(str, words)], check=True, cwd=TOP)

    return run


@pytest.fixture(scope="session")
def gear() -> gmhm.Model:
    """The published gear."""
    return gmhm.Model.load(BENCH / "true_gear.toml")


@pytest.fixture(scope="session")
def cycle() -> gmhm.Recording:
    """A slow cycle of that gear, with noise."""
    return gmhm.read(BENCH / "cycle.csv")


@pytest.fixture(scope="session")
def fitted(cycle: gmhm.Recording) -> gmhm.Fit:
    """A fit of it."""
    return gmhm.fit(cycle, rated_deflection_rad=1.168e-3)
