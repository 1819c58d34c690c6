"""Writes the recordings of this folder with each format's own tools: python3 make.py; .ci/formats installs them and runs it.

Made with Python 3.11, numpy 2, scipy 1.17.1, pyarrow 26.0.1, h5py 3, mcap 1, mcap-ros2-support 0.5,
mat-io 1.0.2. The signals are formulas that recording_formats.rs repeats.
"""

import gzip
import json
import struct
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from matio import save_to_mat
from matio.utils.converters.mattables import timetable_to_mat
from matio.utils.matclass import MatlabOpaque
from mcap.writer import CompressionType
from mcap.writer import Writer as JsonWriter
from mcap_ros2.writer import Writer as Ros2Writer
from scipy.io import savemat

HERE = Path(__file__).parent
k = np.arange(120)
t = np.array([float(f"{i / 10:.1f}") for i in k])
r = (k // 40).astype(float)
y = (k * 7919 % 101) / 101
u = (k * k % 97) / 97 - 0.5


def csv():
    lines = ["t,r,y,u"] + [f"{a},{b},{c!r},{d!r}" for a, b, c, d in zip(t, r, map(float, y), map(float, u))]
    with gzip.GzipFile(HERE / "loop.csv.gz", "wb", mtime=0) as f:
        f.write(("\n".join(lines) + "\n").encode())


def matlab():
    own = {"t": t, "r": r, "y": y, "u": u}
    savemat(HERE / "vectors_v7.mat", {**own, "gain": 3.0, "name": "loop"}, do_compression=True, oned_as="column")
    savemat(HERE / "vectors_v6.mat", own, do_compression=False, oned_as="row")
    # As a logger leaves it: a struct, small integers, single precision, things that are no signals, an empty field.
    log = {
        "time": t.astype(np.float32), "SP": r.astype(np.int16), "PV": y, "OP": u,
        "mode": (k >= 10).astype(np.uint8), "note": "text", "cell": np.array([1, "a"], dtype=object),
        "nothing": np.array([]), "complex": y + 1j, "other_rate": np.arange(7.0),
    }
    savemat(HERE / "struct.mat", {"log": log}, do_compression=True)
    # Simulink's structure with time, and a matrix.
    signals = np.empty(3, dtype=[("values", object), ("label", object)])
    for i, (values, label) in enumerate([(r, "r"), (y, "y"), (u, "u")]):
        signals[i] = (values.reshape(-1, 1), label)
    savemat(HERE / "simulink.mat", {"out": {"time": t, "signals": signals}, "m": np.column_stack([t, r, y, u])})
    # As dSPACE's recorder leaves it: structs X and Y, each with its name beside its data.
    fields = [(field, object) for field in ("Name", "Type", "Data", "Unit", "XIndex")]
    def entries(*named):
        all = np.empty(len(named), dtype=fields)
        for i, (name, data) in enumerate(named):
            all[i] = (name, 4, data, "", 1)
        return all
    blocks = [("Reference", r), ("Plant", y), ("PID Controller", u)]
    run = {
        "X": entries(("time", t)), "Description": "a run",
        "Y": entries(*[(f'"Model Root"/"{block}"/"Out1"', data) for block, data in blocks]),
    }
    savemat(HERE / "dspace.mat", {"run_001": run}, do_compression=True)


def matlab_old():
    own = {"t": t, "r": r, "y": y, "u": u}
    savemat(HERE / "vectors_v4.mat", {**own, "name": "loop"}, format="4")


def matlab_tables():
    """Tables and timetables, which scipy can't write: by mat-io, whose author reads and writes them as MATLAB does."""
    loop = {"SP": r.astype(np.int16), "PV": y, "OP": u}
    steps = pd.to_timedelta(k * 100, unit="ms")
    mode = ["AUTO" if i >= 10 else "MAN" for i in k]
    table = pd.DataFrame({"time": t, **loop, "mode": pd.Categorical(mode), "state": mode})
    timed = pd.DataFrame(loop, index=steps)
    dated = pd.DataFrame(loop, index=pd.Timestamp("2024-05-01T12:00:00") + steps)
    # Rows at even times, of which MATLAB keeps the first and the rate or the step.
    def even(**times):
        properties = timetable_to_mat(timed)
        row_times = np.empty((1, 1), dtype=[(name, object) for name in times])
        for name, value in times.items():
            row_times[0, 0][name] = value
        properties["any"][0, 0]["rowTimes"] = row_times
        return MatlabOpaque(properties=properties, classname="timetable", type_system="MCOS")
    of = lambda milliseconds: np.array([[milliseconds]], "timedelta64[ms]")
    start = np.array([["2024-05-01T12:00:00"]], "datetime64[ms]")
    nothing = np.array([[np.nan]])
    rate = even(origin=start, specifiedAsRate=np.bool_(True), stepSize=of(0), sampleRate=np.array([[10.0]]))
    step = even(origin=of(500), specifiedAsRate=np.bool_(False), stepSize=of(100), sampleRate=nothing)
    for version, name in [("v7", "tables_v7.mat"), ("v7.3", "tables_v73.mat")]:
        everything = {"T": table, "timed": timed, "dated": dated, "rate": rate, "step": step, "gain": np.array([[3.0]])}
        save_to_mat(HERE / name, everything, version=version)


def matlab_hdf5():
    # As MATLAB's -v7.3 lays them out: a user block of 512 bytes, vectors and matrices as their transposes, a class on each.
    with h5py.File(HERE / "vectors_v73.mat", "w", userblock_size=512) as f:
        def put(group, name, values, kind="double"):
            made = group.create_dataset(name, data=values, **({"compression": "gzip", "chunks": True} if values.size > 9 else {}))
            made.attrs["MATLAB_class"] = np.bytes_(kind)
            return made
        log = f.create_group("log")
        log.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, values, kind in [("time", t, "double"), ("SP", r.astype(np.int16), "int16"), ("PV", y, "double"), ("OP", u, "double")]:
            put(log, name, values.reshape(1, -1), kind)
        put(f, "m", np.column_stack([t, r, y, u]).T)
        put(f, "gain", np.array([[3.0]]))
        put(f, "name", np.frombuffer("loop".encode("utf-16-le"), np.uint16).reshape(-1, 1), "char").attrs["MATLAB_int_decode"] = 2
        table = put(f, "T", np.zeros((1, 6), np.uint32), "table")
        table.attrs["MATLAB_object_decode"] = 3
    with open(HERE / "vectors_v73.mat", "r+b") as f:
        f.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM")
    # As h5py users write them.
    with h5py.File(HERE / "plain.h5", "w") as f:
        f["loop/t"], f["loop/r"], f["loop/y"], f["loop/u"] = t, r, y.astype(">f8"), u
        f["data"] = np.column_stack([t, r, y, u])


def mcap():
    text = "bool on\nfloat64 y\nfloat64[] pair"
    with open(HERE / "bag.mcap", "wb") as out:
        writer = Ros2Writer(out)
        sensor = writer.register_msgdef("demo/msg/Sensor", text)
        number = writer.register_msgdef("std_msgs/msg/Float64", "float64 data")
        for i in range(120):
            now = 5_000_000_000 + i * 100_000_000
            if i % 40 == 0:
                writer.write_message("/wanted", number, {"data": float(r[i])}, now - 2_000_000)
            writer.write_message("/control", number, {"data": float(u[i])}, now - 1_000_000)
            writer.write_message("/sensor", sensor, {"on": bool(i >= 10), "y": float(y[i]), "pair": [float(y[i]), 3.0]}, now)
        writer.finish()
    with open(HERE / "json.mcap", "wb") as out:
        writer = JsonWriter(out, compression=CompressionType.LZ4)
        writer.start()
        schema = writer.register_schema("loop", "jsonschema", json.dumps({"type": "object"}).encode())
        channel = writer.register_channel("/loop", "json", schema)
        for i in range(120):
            line = {"sp": float(r[i]), "pv": float(y[i]), "drive": {"op": float(u[i])}}
            writer.add_message(channel, i * 100_000_000, json.dumps(line).encode(), i * 100_000_000)
        writer.finish()


def parquet():
    start = np.datetime64("2024-05-01T12:00:00.000")
    table = pa.table({
        "time": start + (k * 100).astype("timedelta64[ms]"),
        "t": t, "r": r.astype(np.int32), "y": y, "u": u,
        "y32": y.astype(np.float32), "mode": ["AUTO" if i >= 10 else "MAN" for i in k],
        "gaps": pa.array([None if i % 7 == 0 else float(i) for i in k]), "on": k >= 10,
    })
    for codec in ["none", "snappy", "gzip", "zstd", "brotli", "lz4"]:
        pq.write_table(table, HERE / f"loop_{codec}.parquet", compression=codec, row_group_size=50)


def ulog():
    """PX4's ULog as its specification (docs.px4.io, "ULog File Format") states it: pyulog reads only."""

    def message(kind, payload):
        return struct.pack("<HB", len(payload), ord(kind)) + payload

    def data(msg_id, payload):
        return message("D", struct.pack("<H", msg_id) + payload)

    out = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 5_000_000)
    out += message("B", bytes(40))
    out += message("I", bytes([12]) + b"char[4] name" + b"loop")
    out += message("F", b"point:float x;float[2] pair;")
    out += message("F", b"control:uint64_t timestamp;float u;uint8_t[4] _padding0;")
    out += message("F", b"sensor:uint64_t timestamp;double y;int8_t state;point where;bool on;uint8_t[7] _padding1;")
    out += message("F", b"wanted:uint64_t timestamp;double r;")
    for multi_id, msg_id, name in [(0, 0, b"control"), (0, 1, b"sensor"), (1, 2, b"sensor"), (0, 3, b"wanted")]:
        out += message("A", struct.pack("<BH", multi_id, msg_id) + name)
    for i in range(120):
        now = 5_000_000 + i * 100_000
        # r comes only when it changes, u a little before y, as in a flight log.
        if i % 40 == 0:
            out += data(3, struct.pack("<Qd", now - 2_000, r[i]))
        out += data(0, struct.pack("<Qf", now - 1_000, u[i]))
        out += data(1, struct.pack("<Qdbfff?", now, y[i], -1, 1.0, 2.0, 3.0, i >= 10))
        out += data(2, struct.pack("<Qdbfff?", now, -y[i], -1, 1.0, 2.0, 3.0, False))
        if i == 60:
            out += message("L", b"6" + struct.pack("<Q", now) + b"half of it") + message("O", struct.pack("<H", 20))
    (HERE / "flight.ulg").write_bytes(out)


csv()
matlab()
matlab_old()
matlab_tables()
matlab_hdf5()
mcap()
parquet()
ulog()
