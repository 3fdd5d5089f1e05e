"""Measures what the package adds to the program's own time: `python measure.py PATH_OF_GMHM`."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROWS = 2000
MANY_ROWS = 10_000_000
REPEATS = 15
LIMIT_IMPORT_S = 0.1
LIMIT_OVERHEAD_S = 0.005


def least(work: Callable[[], object]) -> float:
    """The least time of several runs, s."""
    times = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return min(times)


def from_arrays(rows: int) -> None:
    """Prints what a recording of arrays takes, beside the fit of it; in a process of its own, for the memory."""
    import resource

    import numpy as np

    import gmhm

    def held() -> float:
        """Memory that is held, MiB; Linux only."""
        return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 2**20

    def most() -> float:
        """Most memory so far, MiB."""
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024

    def timed(work: Callable[[], Any], memory: Callable[[], float]) -> tuple[Any, float, float]:
        before, began = held(), time.perf_counter()
        done = work()
        return done, time.perf_counter() - began, memory() - before

    phase = np.linspace(0.0, 2 * np.pi * max(3, rows // 40_000), rows)
    columns = {"time_s": 1e-3 * np.arange(rows), "deflection_rad": 1.168e-3 * np.sin(phase)}
    columns["torque_nm"] = 2.5e4 * columns["deflection_rad"] + 2.0 * np.cos(phase)
    columns["torque_nm"] += np.random.default_rng(1).normal(0.0, 0.1, rows)
    gmhm.fit({name: column[:1000] for name, column in columns.items()}, compare=False)
    recording, read_s, read_mib = timed(lambda: gmhm.read(columns), held)
    _, fit_s, fit_mib = timed(lambda: gmhm.fit(recording, rated_deflection_rad=1.168e-3, compare=False), most)
    print(f"{rows} rows of 3 arrays: read {1e3 * read_s:.2f} ms and {read_mib:.0f} MiB, fit {1e3 * fit_s:.0f} ms and {fit_mib:.0f} MiB more")


def main(program: str) -> None:
    def interpreter(words: str) -> Callable[[], object]:
        return lambda: subprocess.run([sys.executable, "-c", words], check=True)

    import_s = least(interpreter("import gmhm")) - least(interpreter("pass"))
    import gmhm

    recording = gmhm.demo()
    columns = {name: column[:ROWS] for name, column in recording.to_dict().items()}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rec.csv"
        table = zip(*columns.values(), strict=True)
        path.write_text("\n".join([",".join(columns), *(",".join(map(repr, map(float, row))) for row in table)]))
        words = [program, "--quiet", "fit", str(path), "-o", f"{folder}/gear.toml", "--json", f"{folder}/gear.json"]
        program_s = least(lambda: subprocess.run(words, check=True))
        file_s = least(lambda: gmhm.fit(path))
    arrays_s = least(lambda: gmhm.fit(columns))
    print(f"import gmhm: {1e3 * import_s:.0f} ms (at most {1e3 * LIMIT_IMPORT_S:.0f})")
    print(f"fit of {ROWS} rows: program {1e3 * program_s:.1f} ms, from its file {1e3 * file_s:.1f} ms, from arrays {1e3 * arrays_s:.1f} ms")
    for rows in (ROWS, MANY_ROWS):
        words = [sys.executable, "-c", f"import measure; measure.from_arrays({rows})"]
        print(subprocess.run(words, check=True, cwd=Path(__file__).parent, capture_output=True, text=True).stdout.strip())
    overhead_s = max(file_s, arrays_s) - program_s
    print(f"more than the program: {1e3 * overhead_s:.1f} ms (at most {1e3 * LIMIT_OVERHEAD_S:.0f})")
    if import_s > LIMIT_IMPORT_S or overhead_s > LIMIT_OVERHEAD_S:
        sys.exit("a limit is exceeded")


if __name__ == "__main__":
    main(sys.argv[1])
