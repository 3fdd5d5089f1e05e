"""Checks fleet.py on synthetic joints: python check.py GMHM [--joints N] [--rows N] [--damaged N] [--loop]

All recordings are accounted for although some are damaged, a worker is killed and parts are lost; a rerun on a scheduler of its own does only what is asked; the joint that was made softer is ranked first.
"""

import argparse
import contextlib
import json
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


def kill_a_worker(parts, killed):
    """Kills a worker of this process's cluster once it has done something, as a computer that fails, and notes its number."""
    for _ in range(6000):
        if not any(parts.glob("*.parquet")):
            time.sleep(0.05)
            continue
        listed = subprocess.run(["ps", "-eo", "pid,ppid,args"], capture_output=True, text=True).stdout
        workers = [line.split() for line in listed.splitlines() if "spawn_main" in line]
        mine = [int(pid) for pid, parent, *_ in workers if int(parent) == os.getpid()]
        os.kill(mine[-1], signal.SIGKILL)
        killed.append(mine[-1])
        return


@contextlib.contextmanager
def scheduler():
    """A Dask scheduler and a worker as processes of their own, as on a cluster; the address of the scheduler."""
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as processes:
        file = Path(folder) / "scheduler.json"
        local = ["--host", "127.0.0.1", "--no-dashboard", "--port", "0", "--scheduler-file", str(file)]
        start(processes, ["scheduler", *local])
        worker = ["--no-dashboard", "--nthreads", "1", "--no-nanny", "--local-directory", folder, "--scheduler-file", str(file)]
        for _ in range(600):
            # The file is there a moment before all of it is.
            with contextlib.suppress(OSError, ValueError):
                address = json.loads(file.read_text())["address"]
                break
            time.sleep(0.05)
        start(processes, ["worker", *worker])
        yield address


def start(processes, words):
    """Starts a command of Dask, which ends with the others."""
    process = subprocess.Popen([sys.executable, "-m", "dask", *words], stderr=subprocess.DEVNULL)
    processes.callback(process.wait)
    processes.callback(process.terminate)


def time_each(data, joints, folder, program):
    """Times `gmhm fit --each`, the law chosen, over the first session of each joint, with all cores."""
    listed = folder / "list.txt"
    recordings = [fleet.recording_to(folder, data, group) for group in range(joints)]
    listed.write_text("".join(f"{path}\n" for path in recordings))
    began = time.monotonic()
    subprocess.run([program, "-q", "fit", "--each", "--files-from", listed, "--ndjson", folder / "each.ndjson"], check=True)
    seconds = time.monotonic() - began
    print(f"fit --each, law chosen: {joints} recordings in {seconds:.1f} s on {os.cpu_count()} cores; load {os.getloadavg()[0]:.1f}")


def compare(data, folder, program):
    """Times a plain loop and two workers, the program with one thread in both."""
    seconds = []
    for workers in (0, 2):
        began = time.monotonic()
        output = folder / f"{workers}.parquet"
        fleet.main([str(data), "-o", str(output), "--gmhm", program, "--diagnose", "0", "--workers", str(workers)])
        seconds.append(time.monotonic() - began)
    loop, two = seconds
    print(f"plain loop {loop:.1f} s, two workers {two:.1f} s: {loop / two:.2f} times the throughput; load {os.getloadavg()[0]:.1f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("gmhm")
    parser.add_argument("--joints", type=int, default=40)
    parser.add_argument("--rows", type=int, default=600)
    parser.add_argument("--damaged", type=int, default=4)
    parser.add_argument("--chunk", type=int, default=3)
    parser.add_argument("--loop", action="store_true", help="also time a plain loop")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        data, output = Path(folder) / "fleet.parquet", Path(folder) / "results.parquet"
        damaged = make(data, asked.joints, asked.rows, asked.damaged)
        words = [str(data), "-o", str(output), "--gmhm", asked.gmhm, "--chunk", str(asked.chunk)]
        killed = []
        threading.Thread(target=kill_a_worker, args=[output.with_suffix(".parts"), killed], daemon=True).start()
        rows, ranked, findings = fleet.main(words)
        assert killed, "no worker was killed"
        whole = {(row["row_group"]) for row in rows}
        assert len(rows) == len(whole) == 2 * asked.joints, len(rows)
        errors = [row["error"] for row in rows if not row["ok"]]
        assert len(errors) == damaged and all(errors), errors
        assert ranked[0][2] == "joint-00001", [entry[:3] for entry in ranked[:3]]
        # Each joint is diagnosed, beside its last session.
        table = pq.read_table(output).to_pylist()
        assert len(table) == len(rows)
        diagnosed = [(row["joint"], row["session"]) for row in table if row["diagnosis"]]
        assert sorted(diagnosed) == sorted((row["joint"], row["session"]) for *_, row in ranked), findings

        # Parts that were lost and those with failures are done again, on a cluster that is there already; the others stay.
        parts = sorted(output.with_suffix(".parts").glob("fit-*.parquet"))
        broken = {part for part in parts if not all(pq.read_table(part, columns=["ok"]).column("ok").to_pylist())}
        whole = [part for part in parts if part not in broken]
        assert broken and len(whole) > 1, (broken, whole)
        times = {part: part.stat().st_mtime_ns for part in parts}
        whole[0].unlink()
        with scheduler() as address:
            command = [sys.executable, str(Path(fleet.__file__)), *words, "--retry-failed", "--scheduler", address]
            said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        again = {part for part, at in times.items() if part.stat().st_mtime_ns != at}
        assert again == broken | {whole[0]}, again
        fitted = sum(pq.read_metadata(part).num_rows for part in again)
        assert f"{len(rows)} recordings, {damaged} failed; {fitted} fitted in this run" in said, said
        strip = lambda rows: sorted((row["row_group"], row["ok"], row["model_toml"]) for row in rows)
        assert strip(pq.read_table(output).to_pylist()) == strip(table)
        # Without the words nothing is done again.
        done, *_ = fleet.main([*words, "--workers", "0"])
        assert strip(done) == strip(rows)
        assert {part for part in parts if part.stat().st_mtime_ns == times[part]} == set(parts) - again
        if asked.loop:
            time_each(data, asked.joints, Path(folder), asked.gmhm)
            compare(data, Path(folder), asked.gmhm)


if __name__ == "__main__":
    sys.exit(main())
