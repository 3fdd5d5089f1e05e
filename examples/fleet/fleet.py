"""Fits every recording of a fleet on a Dask cluster, ranks the joints by what changed and diagnoses each.

    python fleet.py recordings.parquet -o results.parquet
    python fleet.py recordings.parquet -o results.parquet --scheduler tcp://scheduler:8786

Each row group of the Parquet files is one recording: columns `joint` and `session` name it, the others are those of a recording (docs/recordings.md).
The program `gmhm` does the work; every worker needs it, and the files, under the same paths. Run again with the same words after a stop: what is done is kept, failures too (--retry-failed does them again).
Needs dask[distributed] and pyarrow.
"""

import argparse
import json
import math
import os
import subprocess
import tempfile
import time
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

NAMES = ("joint", "session")
#: Joints that are printed.
SHOWN = 10
COLUMNS = [("file", pa.string()), ("row_group", pa.int64()), ("joint", pa.string()), ("session", pa.string())]
COLUMNS += [("ok", pa.bool_()), ("error", pa.string()), ("result", pa.string()), ("model_toml", pa.string())]
FINDINGS = [("effects", pa.list_(pa.string())), ("diagnosis", pa.string()), ("diagnosis_error", pa.string())]


def gmhm(program, words):
    """Runs gmhm with one thread: the cluster has one worker for each core."""
    environment = os.environ | {"RAYON_NUM_THREADS": "1"}
    done = subprocess.run([program, "-q", *words], env=environment, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"gmhm {' '.join(words)}: {done.stderr.strip()}")


def recordings_of(file):
    """Joint, session and number of each row group, by the statistics of the file where it has them."""
    data = pq.ParquetFile(file)
    places = [data.schema_arrow.get_field_index(name) for name in NAMES]
    for group in range(data.num_row_groups):
        named = []
        for name, place in zip(NAMES, places):
            statistics = data.metadata.row_group(group).column(place).statistics
            if statistics is not None and statistics.has_min_max:
                found = {statistics.min, statistics.max}
            else:
                found = set(data.read_row_group(group, columns=[name]).column(name).to_pylist())
            if len(found) != 1:
                raise SystemExit(f"{file}: row group {group} holds {len(found)} values of `{name}`; write one row group a recording")
            named.append(str(found.pop()))
        yield *named, group


def recording_to(folder, file, group):
    """Writes a row group as a recording of its own; its path."""
    table = pq.ParquetFile(file).read_row_group(group)
    path = Path(folder) / f"{group}.parquet"
    pq.write_table(table.drop_columns(list(NAMES)), path)
    return path


def save(rows, path, columns):
    """A table that appears whole or not at all."""
    draft = path.with_suffix(f".{os.getpid()}.tmp")
    pq.write_table(pa.Table.from_pylist(rows, schema=pa.schema(columns)), draft)
    draft.replace(path)


def saved(parts, name):
    """The rows of all parts of a name."""
    return [row for part in sorted(parts.glob(f"{name}-*.parquet")) for row in pq.read_table(part).to_pylist()]


def each(command, words, recordings, program):
    """Lines of `gmhm COMMAND --each`, by the path of the recording."""
    with tempfile.TemporaryDirectory() as folder:
        listed, lines = Path(folder) / "list.txt", Path(folder) / "lines.ndjson"
        listed.write_text("".join(f"{path}\n" for path in recordings))
        gmhm(program, [command, "--each", *words, "--files-from", str(listed), "--ndjson", str(lines)])
        return {line["recording"]: line for line in map(json.loads, lines.read_text().splitlines())}


def fit_rows(rows, words, program):
    """Fits recordings and fills their rows; a damaged one gets an error."""
    for row in rows:
        row["ok"] = False
    with tempfile.TemporaryDirectory() as folder:
        paths = {}
        for number, row in enumerate(rows):
            try:
                own = Path(folder) / str(number)
                own.mkdir()
                paths[str(recording_to(own, row["file"], row["row_group"]))] = row
            except Exception as error:
                row["error"] = str(error)
        for path, line in each("fit", words, paths, program).items() if paths else ():
            row = paths[path]
            row["ok"], row["error"] = line["ok"], line.get("error")
            if line["ok"]:
                row["model_toml"] = line["result"].pop("model_toml")
                row["result"] = json.dumps(line["result"])


def fit_joints(joints, part, program):
    """Fits all sessions of some joints into a part of the results: the first one with the law that suits it, the others with the same, so that they can be compared."""
    fit_rows([sessions[0] for sessions in joints], [], program)
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder) / "first.toml"
        for first, *others in joints:
            model.write_text(first.get("model_toml", ""))
            if others:
                fit_rows(others, ["--model", str(model)] if first["ok"] else [], program)
    rows = [row for sessions in joints for row in sessions]
    save(rows, part, COLUMNS)
    return len(rows)


def diagnose_joint(first, last, part, program):
    """What the last session of a joint shows beside the model of its first one, into a part of the results."""
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder) / "first.toml"
        model.write_text(first["model_toml"])
        path = recording_to(folder, last["file"], last["row_group"])
        line = each("diagnose", [str(model)], [path], program)[str(path)]
    found = {"joint": last["joint"], "session": last["session"], "diagnosis_error": line.get("error")}
    if line["ok"]:
        found["effects"] = [effect["name"] for effect in line["result"]["effects"]]
        found["diagnosis"] = json.dumps(line["result"])
    save([found], part, COLUMNS[2:4] + FINDINGS)


def changes(rows):
    """Joints by their largest change from the first session to the last, in standard deviations, of all quantities that catalogues quote."""
    joints = {}
    for row in sorted((row for row in rows if row["ok"]), key=lambda row: row["session"]):
        joints.setdefault(row["joint"], []).append(row)
    ranked = []
    for joint, sessions in joints.items():
        first, last = sessions[0], sessions[-1]
        before, after = (
            {q["name"]: q for q in (json.loads(row["result"])["catalogue"] or {"quantities": []})["quantities"]}
            for row in (first, last)
        )
        moved = [(0.0, "")]
        for name in before.keys() & after.keys():
            spread = math.hypot(before[name]["sd"] or 0.0, after[name]["sd"] or 0.0)
            if first is not last and spread > 0.0:
                moved.append((abs(after[name]["value"] - before[name]["value"]) / spread, name))
        ranked.append((*max(moved), joint, first, last))
    return sorted(ranked, key=lambda entry: (-entry[0], entry[2]))


def forget_failed(parts):
    """Removes the parts in which a recording failed, and the diagnoses of their joints, so that they are done again."""
    again = set()
    for part in parts.glob("fit-*.parquet"):
        rows = pq.read_table(part).to_pylist()
        if not all(row["ok"] for row in rows):
            again.update(row["joint"] for row in rows)
            part.unlink()
    for part in parts.glob("diagnosis-*.parquet"):
        (row,) = pq.read_table(part).to_pylist()
        if row["diagnosis_error"] or row["joint"] in again:
            part.unlink()


def tasks(files, parts, chunk):
    """Chunks of joints that have no part of the results yet."""
    joints = {}
    for file in files:
        for joint, session, group in recordings_of(file):
            joints.setdefault(joint, []).append({"joint": joint, "session": session, "file": str(file), "row_group": group})
    sorted_joints = [sorted(rows, key=lambda row: row["session"]) for _, rows in sorted(joints.items())]
    for start in range(0, len(sorted_joints), chunk):
        part = parts / f"fit-{start:08}.parquet"
        if not part.exists():
            yield sorted_joints[start : start + chunk], part


def run(client, function, arguments, program):
    """Calls of a function on the cluster, or one after the other; a worker that dies is replaced, and its task done again."""
    if client is None:
        return [function(*call, program) for call in arguments]
    return client.gather([client.submit(function, *call, program, retries=3, pure=False) for call in arguments])


def main(words=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path, help="Parquet files, a recording a row group")
    parser.add_argument("-o", "--output", type=Path, required=True, help="Parquet file of the results")
    parser.add_argument("--scheduler", help="address of a Dask scheduler; else a cluster on this computer")
    parser.add_argument("--workers", type=int, default=2, help="workers of the cluster on this computer; 0 for a plain loop")
    parser.add_argument("--chunk", type=int, default=20, help="joints of a task: so many that starting the program does not count")
    parser.add_argument("--retry-failed", action="store_true", help="do the chunks again in which a recording failed, and their diagnoses")
    parser.add_argument("--diagnose", type=int, metavar="N", help="diagnose only the N joints that changed most")
    parser.add_argument("--gmhm", default="gmhm", help="the program")
    asked = parser.parse_args(words)
    parts = asked.output.with_suffix(".parts")
    parts.mkdir(parents=True, exist_ok=True)
    if asked.retry_failed:
        forget_failed(parts)
    client = None
    if asked.scheduler or asked.workers > 0:
        from dask.distributed import Client

        local = {"n_workers": asked.workers, "threads_per_worker": 1, "processes": True, "dashboard_address": None}
        client = Client(asked.scheduler) if asked.scheduler else Client(**local)
    began = time.monotonic()
    fitted = sum(run(client, fit_joints, list(tasks(asked.files, parts, asked.chunk)), asked.gmhm))
    seconds = time.monotonic() - began

    rows = saved(parts, "fit")
    failed = sum(not row["ok"] for row in rows)
    print(f"{len(rows)} recordings, {failed} failed; {fitted} fitted in this run, {seconds:.1f} s")
    ranked = changes(rows)
    numbers = {joint: number for number, joint in enumerate(sorted(row["joint"] for row in rows))}
    began = time.monotonic()
    pending = [
        (first, last, part)
        for *_, joint, first, last in ranked[: asked.diagnose]
        if not (part := parts / f"diagnosis-{numbers[joint]:08}.parquet").exists()
    ]
    run(client, diagnose_joint, pending, asked.gmhm)
    print(f"{len(pending)} joints diagnosed in this run, {time.monotonic() - began:.1f} s")
    findings = {(row.pop("joint"), row.pop("session")): row for row in saved(parts, "diagnosis")}
    save([row | findings.get((row["joint"], row["session"]), {}) for row in rows], asked.output, COLUMNS + FINDINGS)
    for size, quantity, joint, _, last in ranked[: asked.diagnose][:SHOWN]:
        found = findings[joint, last["session"]]
        named = found["diagnosis_error"] or ", ".join(found["effects"]) or "no physics beyond the model"
        print(f"{joint}: {quantity or 'nothing'} changed by {size:.1f} standard deviations; {named}")
    asked.output.with_suffix(".ranking.json").write_text(
        json.dumps([{"joint": joint, "quantity": quantity, "standard_deviations": size} for size, quantity, joint, *_ in ranked])
    )
    if client is not None:
        client.close()
    return rows, ranked, findings


if __name__ == "__main__":
    main()
