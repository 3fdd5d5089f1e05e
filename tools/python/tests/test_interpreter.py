"""What the package does to its interpreter: threads run, Ctrl-C ends, imports are quick and few, forks work."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator

import gmhm
import numpy as np
import pytest
from conftest import BENCH

#: Long enough to be interrupted.
ROWS = 60_000


def long_recording() -> gmhm.Recording:
    time_s = np.arange(ROWS) / 500.0
    deflection_rad = 1.1e-3 * np.sin(0.7 * time_s) * np.cos(0.013 * time_s)
    torque_nm = 2.5e4 * deflection_rad + np.random.default_rng(1).normal(0, 0.1, ROWS)
    return gmhm.read({"time_s": time_s, "deflection_rad": deflection_rad, "torque_nm": torque_nm})


@pytest.fixture
def ctrl_c_raises() -> Iterator[None]:
    """A shell starts what runs in its background with the signal ignored, and Python then raises nothing."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("ctrl_c_raises")
def test_ctrl_c_ends_a_fit_and_leaves_the_interpreter_alive() -> None:
    recording = long_recording()
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        for _ in range(100):
            gmhm.fit(recording)
    assert time.monotonic() - began < 3.0
    assert gmhm.fit(BENCH / "cycle.csv", compare=False).rows > 0


def test_other_threads_run_during_a_fit() -> None:
    recording = long_recording()
    ticks, done = [0], threading.Event()

    def tick() -> None:
        while not done.wait(0.001):
            ticks[0] += 1

    thread = threading.Thread(target=tick)
    thread.start()
    began = time.monotonic()
    gmhm.fit(recording, compare=False)
    elapsed = time.monotonic() - began
    done.set()
    thread.join()
    # A held lock would let no tick pass.
    assert ticks[0] > 20 * elapsed, (ticks, elapsed)


def fitted_rms(path: str) -> float:
    return gmhm.fit(path, compare=False).rms


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_a_forked_process_has_threads_of_its_own() -> None:
    path = str(BENCH / "cycle.csv")
    expected = fitted_rms(path)
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert pool.map_async(fitted_rms, [path] * 2).get(timeout=120) == [expected] * 2


def test_import_needs_neither_numpy_nor_matplotlib() -> None:
    words = "import sys, gmhm; print(sorted({'numpy', 'matplotlib', 'pandas', 'typing_extensions'} & set(sys.modules)))"
    said = subprocess.run([sys.executable, "-c", words], check=True, capture_output=True, text=True).stdout
    assert said.strip() == "[]"
