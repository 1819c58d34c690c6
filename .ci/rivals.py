"""Times drift and its rivals on one recording; see .ci/rivals, which starts it."""

import json
import os
import pathlib
import statistics
import subprocess
import sys

drift, place, rows, rounds = sys.argv[1], pathlib.Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4])
LOOP = "examples/loops/paper.toml"
csv, baseline, copy = place / "log.csv", place / "baseline.toml", place / "copy.csv"
SIMULATE = [drift, "simulate", LOOP, "--reference-mean", "0.1", "--reference-sd", "1", "--seed", "1"]
simulate = [*SIMULATE, "--duration", str(rows / 1000), "-o"]


def python(code):
    return [sys.executable, "-c", code, str(csv), str(copy)]


READ = {
    "drift monitor": [drift, "monitor", str(csv), "--baseline", str(baseline), "--json", "-"],
    "polars": python(
        "import sys, polars as p; d = p.read_csv(sys.argv[1]); print(d.height, d['y'].sum(), d['u'].sum())"
    ),
    "duckdb": python(
        "import sys, duckdb; print(*duckdb.sql(f\"select count(t + r), sum(y), sum(u) from '{sys.argv[1]}'\").fetchall()[0])"
    ),
    "pandas": python(
        "import sys, pandas as p; d = p.read_csv(sys.argv[1]); print(len(d), d['y'].sum(), d['u'].sum())"
    ),
    "parser by hand, C": [str(place / "parser"), str(csv)],
    "cat": ["cat", str(csv)],
}
WRITE = {
    "drift simulate": [*simulate, str(copy)],
    # Reading what it writes is taken off.
    "polars": python("import sys, polars as p; p.read_csv(sys.argv[1]).write_csv(sys.argv[2])"),
}


def run(command):
    """Its output and the processor time it took, s."""
    before = os.times()
    done = subprocess.run(command, stdout=subprocess.PIPE, check=True)
    after = os.times()
    took = after.children_user + after.children_system - before.children_user - before.children_system
    return done.stdout, took


def timed(commands):
    """Medians of interleaved runs, and each command's last output."""
    times, outputs = {name: [] for name in commands}, {}
    for _ in range(rounds):
        for name, command in commands.items():
            outputs[name], took = run(command)
            times[name].append(took)
    return {name: statistics.median(took) for name, took in times.items()}, outputs


def same(outputs):
    """Everybody has read the same rows: their count, and the sums of y and u."""
    samples = json.loads(outputs["drift monitor"].splitlines()[-1])["summary"]["samples"]
    assert samples == rows, f"drift read {samples} rows"
    wanted = [float(word) for word in outputs["polars"].split()]
    for name in ("duckdb", "pandas", "parser by hand, C"):
        got = [float(word) for word in outputs[name].split()]
        close = all(abs(g - w) <= 1e-6 * max(1.0, abs(w)) for g, w in zip(got, wanted, strict=True))
        assert close and got[0] == rows, f"{name} read {got}, polars {wanted}"


def show(title, times, ours):
    print(f"\n| {title} | s | ns a row | to drift |\n|---|---|---|---|")
    for name, took in times.items():
        print(f"| {name} | {took:.2f} | {took / rows * 1e9:.0f} | {took / times[ours]:.2f} |")


run([*simulate, str(csv)])
run([*SIMULATE, "--duration", "2000", "-o", str(copy)])
run([drift, "calibrate", str(copy), "-o", str(baseline), "--window", "3"])
reading, outputs = timed(READ)
same(outputs)
show(f"reading {rows} rows of CSV ({csv.stat().st_size / 1e6:.0f} MB), processor time on one core", reading, "drift monitor")
writing, _ = timed(WRITE)
writing["polars"] = max(writing["polars"] - reading["polars"], 0.0)
show(f"writing {rows} rows of CSV", writing, "drift simulate")
