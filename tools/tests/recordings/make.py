"""Writes one small recording in every format that gmhm reads, each by the tool that its users have.

    pip install numpy pandas pyarrow scipy h5py hdf5storage asammdf mcap mcap-ros2-support zstandard
    python make.py

The numbers are made up: they belong to this project. `expected.csv` holds them to the last bit.
"""

import gzip
import json
import pathlib
import struct

import h5py
import hdf5storage
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import scipy.io
import zstandard
from asammdf import MDF, Signal
from asammdf.blocks.conversion_utils import from_dict
from mcap.writer import CompressionType, Writer
from mcap_ros2.writer import Writer as Ros2Writer

HERE = pathlib.Path(__file__).parent
ROWS = 24

k = np.arange(ROWS)
time = k / 64.0
twist = 1e-3 * np.sin(0.37 * k) + 1e-7 * k
torque = 24.737e3 * twist + 3.1 * np.cos(0.37 * k)
temperature = 20 + k // 4
columns = {"time_s": time, "deflection_rad": twist, "torque_nm": torque, "temperature_c": temperature.astype(float)}
frame = pd.DataFrame(columns)


def text():
    frame.to_csv(HERE / "expected.csv", index=False, float_format="%.17g")
    plain = (HERE / "expected.csv").read_bytes()
    (HERE / "gzip.csv.gz").write_bytes(gzip.compress(plain, mtime=0))
    (HERE / "zstd.csv.zst").write_bytes(zstandard.compress(plain))
    np.savetxt(HERE / "numpy.txt", frame.to_numpy(), fmt="%.17g", header=" ".join(columns))


def parquet():
    frame.to_parquet(HERE / "pandas.parquet")  # snappy
    for codec in ["none", "gzip", "zstd", "lz4"]:
        pq.write_table(pa.Table.from_pandas(frame), HERE / f"pyarrow_{codec}.parquet", compression=codec, row_group_size=10)
    stamped = frame.drop(columns="time_s")
    stamped.insert(0, "stamp", pd.to_datetime(1_700_000_000_000_000_000 + (k * 15_625_000), unit="ns"))
    stamped["note"] = "text"
    stamped["temperature_c"] = pd.array(temperature, dtype="Int32")
    stamped.to_parquet(HERE / "stamps.parquet")
    gap = frame.copy()
    gap.loc[5, "torque_nm"] = None
    gap.to_parquet(HERE / "gap.parquet")


def parquet_groups():
    whole = pa.Table.from_pandas(frame, preserve_index=False)
    # Groups of several sizes, two of them empty, without statistics and dictionaries, in pages of version 2.
    bare = dict(write_statistics=False, use_dictionary=False, data_page_version="2.0", compression="none")
    with pq.ParquetWriter(HERE / "pyarrow_bare.parquet", whole.schema, **bare) as writer:
        for first, rows in [(0, 0), (0, 7), (7, 1), (8, 0), (8, 16)]:
            writer.write_table(whole.slice(first, rows))
    # Every kind of number beside the torque, in chunks, from dictionaries, and columns that may be null and are not.
    def chunked(values, kind):
        values = [value.item() if hasattr(value, "item") else value for value in values]
        return pa.chunked_array([pa.array(values[:5], kind), pa.array(values[5:], kind)])

    kinds = {"i8": pa.int8(), "i16": pa.int16(), "i32": pa.int32(), "i64": pa.int64(), "u8": pa.uint8(), "u16": pa.uint16(), "u32": pa.uint32(), "u64": pa.uint64()}
    types = {name: chunked(column, pa.float64()) for name, column in columns.items() if name != "temperature_c"}
    types["f32"] = chunked(torque, pa.float32())
    types |= {name: chunked(temperature, kind) for name, kind in kinds.items()}
    types["dictionary"] = pa.array(temperature.astype(float)).dictionary_encode()
    types["flag"] = chunked(temperature > 22, pa.bool_())
    types["label"] = pa.array([f"row {row}" for row in k])
    pq.write_table(pa.table(types), HERE / "pyarrow_types.parquet", row_group_size=9, write_statistics=False)
    # A group without a single value.
    hole = frame.copy()
    hole.loc[8:15, "torque_nm"] = None
    table = pa.Table.from_pandas(hole, preserve_index=False)
    pq.write_table(table, HERE / "hole.parquet", row_group_size=8, write_statistics=False)


def mat():
    scipy.io.savemat(HERE / "scipy.mat", columns)
    scipy.io.savemat(HERE / "scipy_packed.mat", columns, do_compression=True, oned_as="column")
    log = {"t": time, "motion": {"twist": twist}, "torque": np.column_stack([temperature, torque]), "unit": "Nm"}
    scipy.io.savemat(HERE / "scipy_struct.mat", {"log": log, "gear": 100.0, "cells": np.array([1, "a"], dtype=object)})
    hdf5storage.savemat(str(HERE / "hdf5storage_73.mat"), {"log": log}, format="7.3", store_python_metadata=False)
    with h5py.File(HERE / "h5py_73.mat", "w", userblock_size=512) as file:
        for name, values in columns.items():
            file.create_dataset(name, data=values.reshape(1, -1), compression="gzip").attrs["MATLAB_class"] = np.bytes_("double")
    header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Sun Nov 22 2026".ljust(124) + b"\x00\x02IM"
    with open(HERE / "h5py_73.mat", "r+b") as file:
        file.write(header)
    with h5py.File(HERE / "plain.h5", "w") as file:
        file["torque_nm"] = torque


def mdf():
    def signals(scaled):
        yield Signal(twist, time, name="Deflection", unit="rad")
        yield Signal(torque, time, name="Torque", unit="N·m")
        if scaled:
            conversion = from_dict({"a": 0.5, "b": 10.0})
            raw = ((temperature - 10) * 2).astype(np.uint16)
            yield Signal(raw, time, name="Temperature", unit="degC", conversion=conversion)

    for name, options in [("plain", {}), ("deflated", {"compression": 1}), ("transposed", {"compression": 2})]:
        file = MDF(version="4.10")
        file.append(list(signals(True)), comment="bench")
        slow = np.arange(5) / 2.0
        file.append([Signal(np.arange(5, dtype=np.int8), slow, name="State")], comment="slow")
        file.save(HERE / f"asammdf_{name}.mf4", overwrite=True, **options)


JOINT_STATE = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec"""


def mcap():
    start = 1_700_000_000_000_000_000
    for name, compression in [("zstd", CompressionType.ZSTD), ("lz4", CompressionType.LZ4), ("plain", CompressionType.NONE)]:
        with open(HERE / f"joint_states_{name}.mcap", "wb") as out:
            writer = Ros2Writer(out, compression=compression)
            schema = writer.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
            for i in range(ROWS):
                stamp = start + i * 15_625_000
                writer.write_message(
                    topic="/joint_states",
                    schema=schema,
                    message={
                        "header": {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": "base"},
                        "name": ["shoulder", "elbow", "wrist"],
                        "position": [0.0, float(twist[i]), 1.0],
                        "velocity": [],
                        "effort": [0.5, 1.5, float(torque[i])],
                    },
                    log_time=stamp + 1000 * (i % 3),
                    publish_time=stamp,
                )
            writer.finish()
    with open(HERE / "json.mcap", "wb") as out:
        writer = Writer(out)
        writer.start()
        channel = writer.register_channel("/bench", "json", 0)
        for i in range(ROWS):
            message = {"time_s": time[i], "deflection_rad": twist[i], "torque_nm": torque[i]}
            writer.add_message(channel, start + i * 15_625_000, json.dumps(message).encode(), start)
        writer.finish()


for write in [text, parquet, parquet_groups, mat, mdf, mcap]:
    write()
