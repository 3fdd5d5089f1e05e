"""Checks fleet.py on synthetic joints: python check.py GMHM [--joints N] [--rows N] [--damaged N] [--loop]

All recordings are accounted for although some are damaged, a worker is killed and the run is stopped in its middle; the joint that was made softer is ranked first.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

import fleet

A, ALPHA, BETA, OMEGA = 1.168e-3, 2.6532e6, 422.68, 226.31
E, H = ALPHA * BETA / (BETA**2 + OMEGA**2), ALPHA * OMEGA / (BETA**2 + OMEGA**2)
COLUMNS = [("joint", pa.string()), ("session", pa.string())]
COLUMNS += [(name, pa.float64()) for name in ("time_s", "deflection_rad", "torque_nm")]


def recording(random, c1, rows):
    """The rated cycle of a gear, from its steady state."""
    phase = np.pi / 2 + np.linspace(0.0, 6 * np.pi, rows)
    u, g = np.sin(phase), np.abs(np.cos(phase))
    theta = A * u
    torque = c1 * theta + 1.0e9 * theta**3 - 1.1774e14 * theta**5 - E * theta * g + np.sign(np.cos(phase)) * H * A * g**2
    return {"time_s": 0.01 * np.arange(rows), "deflection_rad": theta, "torque_nm": torque + random.normal(0.0, 0.05, rows)}


def make(path, joints, rows, damaged):
    """A file with two sessions of each joint; joint 1 got softer, and some recordings are damaged."""
    random = np.random.default_rng(1)
    schema = pa.schema(COLUMNS)
    stiffness = 2.4737e4 * random.uniform(0.95, 1.05, joints)
    broken = {int(k) for k in 4 + np.arange(damaged) * max(1, (2 * joints - 4) // max(1, damaged))}
    with pq.ParquetWriter(path, schema) as writer:
        for session in range(2):
            for joint in range(joints):
                softer = 0.95 if (joint, session) == (1, 1) else 1.0
                columns = recording(random, softer * stiffness[joint], rows)
                if session * joints + joint in broken:
                    columns["torque_nm" if joint % 2 else "time_s"] = np.full(rows, np.nan)
                names = {"joint": [f"joint-{joint:05}"] * rows, "session": [f"day-{session}"] * rows}
                writer.write_table(pa.table(names | columns, schema=schema), row_group_size=rows)
    return len(broken)


def kill_a_worker(parts):
    """Kills a worker of this process's cluster once it has done something, as a computer that fails."""
    for _ in range(6000):
        if not any(parts.glob("*.parquet")):
            time.sleep(0.05)
            continue
        listed = subprocess.run(["ps", "-eo", "pid,ppid,args"], capture_output=True, text=True).stdout
        workers = [line.split() for line in listed.splitlines() if "spawn_main" in line]
        mine = [int(pid) for pid, parent, *_ in workers if int(parent) == os.getpid()]
        os.kill(mine[-1], signal.SIGKILL)
        print(f"killed worker {mine[-1]} of {len(mine)}")
        return


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("gmhm")
    parser.add_argument("--joints", type=int, default=40)
    parser.add_argument("--rows", type=int, default=600)
    parser.add_argument("--damaged", type=int, default=4)
    parser.add_argument("--chunk", type=int, default=5)
    parser.add_argument("--loop", action="store_true", help="also time a plain loop")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        data, output = Path(folder) / "fleet.parquet", Path(folder) / "results.parquet"
        damaged = make(data, asked.joints, asked.rows, asked.damaged)
        words = [str(data), "-o", str(output), "--gmhm", asked.gmhm, "--diagnose", "1", "--chunk", str(asked.chunk)]
        threading.Thread(target=kill_a_worker, args=[output.with_suffix(".parts")], daemon=True).start()
        rows, ranked, findings = fleet.main(words)
        whole = {(row["row_group"]) for row in rows}
        assert len(rows) == len(whole) == 2 * asked.joints, len(rows)
        errors = [row["error"] for row in rows if not row["ok"]]
        assert len(errors) == damaged and all(errors), errors
        assert ranked[0][2] == "joint-00001", [entry[:3] for entry in ranked[:3]]
        assert findings[0]["ok"], findings

        # Parts that were lost are done again, the others stay.
        parts = sorted(output.with_suffix(".parts").glob("*.parquet"))
        kept = [part.stat().st_mtime_ns for part in parts[1:]]
        parts[0].unlink()
        again, *_ = fleet.main([*words, "--workers", "1"])
        assert [part.stat().st_mtime_ns for part in parts[1:]] == kept
        strip = lambda rows: sorted((row["row_group"], row["ok"], row["model_toml"]) for row in rows if row["ok"])
        assert strip(again) == strip(rows)
        if asked.loop:
            fleet.main([str(data), "-o", str(Path(folder) / "loop.parquet"), "--gmhm", asked.gmhm, "--diagnose", "0", "--workers", "0"])
            fleet.main([str(data), "-o", str(Path(folder) / "two.parquet"), "--gmhm", asked.gmhm, "--diagnose", "0"])


if __name__ == "__main__":
    sys.exit(main())
