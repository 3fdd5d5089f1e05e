"""Measures what the package adds to the program's own time: `python measure.py PATH_OF_GMHM`."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

ROWS = 2000
MANY_ROWS = 1_000_000
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


def main(program: str) -> None:
    def interpreter(words: str) -> Callable[[], object]:
        return lambda: subprocess.run([sys.executable, "-c", words], check=True)

    import_s = least(interpreter("import gmhm")) - least(interpreter("pass"))
    import numpy as np

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
    many = {name: np.linspace(0.0, 1.0, MANY_ROWS) for name in columns}
    read_s = least(lambda: gmhm.read(many))
    copy_s = least(lambda: [column.copy() for column in many.values()])
    print(f"import gmhm: {1e3 * import_s:.0f} ms (at most {1e3 * LIMIT_IMPORT_S:.0f})")
    print(f"fit of {ROWS} rows: program {1e3 * program_s:.1f} ms, from its file {1e3 * file_s:.1f} ms, from arrays {1e3 * arrays_s:.1f} ms")
    print(f"read of {MANY_ROWS} rows of {len(many)} arrays: {1e3 * read_s:.1f} ms, {1e3 * copy_s:.1f} ms of which one copy takes")
    overhead_s = max(file_s, arrays_s) - program_s
    print(f"more than the program: {1e3 * overhead_s:.1f} ms (at most {1e3 * LIMIT_OVERHEAD_S:.0f})")
    if import_s > LIMIT_IMPORT_S or overhead_s > LIMIT_OVERHEAD_S:
        sys.exit("a limit is exceeded")


if __name__ == "__main__":
    main(sys.argv[1])
