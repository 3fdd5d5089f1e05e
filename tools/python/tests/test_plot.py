"""Pictures are drawn of every result."""

from __future__ import annotations

import gmhm
import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest
from conftest import BENCH
from gmhm import plot

matplotlib.use("agg")


def test_pictures_show_what_was_measured_and_modelled(fitted: gmhm.Fit, gear: gmhm.Model) -> None:
    axes = plot.loop(fitted)
    assert [len(np.asarray(line.get_xdata())) for line in axes.lines] == [len(fitted.recordings[0])] * 2
    assert axes.get_ylabel() == "torque, N·m"
    assert plot.residual(fitted, axes=axes) is axes
    assert len(plot.torque(gear, gmhm.read(BENCH / "running.csv")).lines) == 4
    found = gmhm.diagnose(BENCH / "running.csv", gear)
    assert len(plot.effects(found).patches) == len(found.effects)
    health = gmhm.health([BENCH / "cycle.csv", BENCH / "amplitudes.csv"])
    assert plot.trend(health, "K1").get_ylabel() == "K1, N·m/rad"
    with pytest.raises(KeyError, match="the quantities are"):
        plot.trend(health, "K4")
    plt.close("all")
