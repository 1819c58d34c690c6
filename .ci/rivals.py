"""Times drift, its rivals and the physical limits on the same work; see .ci/rivals, which starts it."""

import json
import os
import pathlib
import statistics
import subprocess
import sys
from dataclasses import dataclass, field
from typing import Callable

mode, drift, inner, place = sys.argv[1], sys.argv[2], sys.argv[3], pathlib.Path(sys.argv[4])
rows, rounds = int(sys.argv[5]), int(sys.argv[6])
LOOP = "examples/loops/paper.toml"
RECORDED = pathlib.Path(".ci/rivals.json")
# A loss of more than this is refused on a processor whose ratios are recorded. From one build to the next the same loop lies elsewhere in the program:
# reading CSV took 1.13 times as long on one processor and as long as before on another, for 0.9 % more instructions (callgrind).
ALLOWED = 1.25
# On another one each row is held against its greatest ratio on any of those: from one processor to the next ratios differ by more than a loss would be.
ALLOWED_ELSEWHERE = 1.50
# What each loop is to take, in times what another program of its table does: the goal that was set, over that program's time on the machine where it was set.
GOALS = {
    "monitor, CSV": ("parser by hand, C, of the CSV", 2.0 / 1.1),
    "monitor, Parquet": ("duckdb", 0.8 / 0.6),
    "simulate, CSV": ("parser by hand, C, of the CSV", 120 / 55),
    "tick": ("sums by hand, Rust", 2.9 / 2.9),
    "ticks": ("sums by hand, Rust", 1.0 / 0.6),
    "step": ("the recursion by hand, C", 6.0 / 4.0),
    "simulate": ("the recursion by hand, C", 8.0 / 4.0),
}
csv, parquet, baseline, copy = (place / name for name in ("log.csv", "log.parquet", "baseline.toml", "copy.csv"))
SIMULATE = [drift, "simulate", LOOP, "--reference-mean", "0.1", "--reference-sd", "1", "--seed", "1"]
simulate = [*SIMULATE, "--duration", str(rows / 1000), "-o"]
# Ticks and steps: a tenth of a second and more of each.
ticks, steps = max(rows * 10, 20_000_000), max(rows * 5, 10_000_000)
parser, loop, nexus = str(place / "parser"), str(place / "loop"), str(place / "nexus/release/rivals-nexus")


def python(code, *arguments):
    return [sys.executable, "-c", code, *map(str, arguments)]


def inside(code, *arguments):
    """Python that is timed from within, once it has started and compiled: its last word is its processor time."""
    samples = """
import sys, time, numpy as n
count = int(sys.argv[1])
def uniform(size):
    seeds, seed = n.empty(size, n.uint32), 1
    for i in range(size):
        seed = (seed * 1664525 + 1013904223) & 0xffffffff
        seeds[i] = seed
    return (seeds >> 8) / 2.0**24
def timed(work):
    work(); begin = time.process_time(); said = work(); print(*said, time.process_time() - begin)
"""
    return python(samples + code, *arguments)


PAIR = """
x = uniform(12000) - 0.5
r, y, u = x[:4000].astype('f4'), x[4000:8000].astype('f4'), (10 * x[8000:]).astype('f4')
"""
NUMBA_PAIR = (
    PAIR
    + """
import numba
@numba.njit(fastmath=True)
def blocks(r, y, u, rounds):
    sums, decisions = n.zeros((16, 2), n.float32), 0
    for _ in range(rounds):
        for b in range(16):
            energy, error = n.float32(0), n.float32(0)
            for i in range(250 * b, 250 * b + 250):
                energy += u[i] * u[i]; error += abs(r[i] - y[i])
            sums[b, 0], sums[b, 1] = energy, error
        decisions += 1
    return decisions, sums[:, 0].sum() * 1e-3, sums[:, 1].sum() * 1e-3
timed(lambda: blocks(r, y, u, count // 4000))
"""
)
NUMPY_PAIR = (
    PAIR
    + """
def blocks():
    for k in range(count // 4000):
        energy = n.einsum('ij,ij->i', u.reshape(16, 250), u.reshape(16, 250))
        error = n.abs(r - y).reshape(16, 250).sum(1)
    return count // 4000, energy.sum() * 1e-3, error.sum() * 1e-3
timed(blocks)
"""
)
# The discrete model of the plant, and r as the loop's rivals have it.
PLANT = """
from cmath import exp
pole = -0.2 - 2j
turn = exp(pole * 1e-3); held = (turn - 1) / pole
c, s, g0, g1 = turn.real, -turn.imag, held.real, held.imag
r = n.tile(uniform(4000) - 0.4, 100)
parts = count // 400000
"""
NUMBA_LOOP = (
    PLANT
    + """
import numba
@numba.njit
def run(r, y, u):
    x0 = x1 = total = 0.0
    for i in range(len(r)):
        y[i] = x0; e = r[i] - x0; total += 100.0 * 0.001 * e; u[i] = 300.0 * e + total
        x0, x1 = c * x0 + s * x1 + g0 * u[i], c * x1 - s * x0 + g1 * u[i]
def all_parts():
    for _ in range(parts):
        y, u = n.empty(len(r)), n.empty(len(r)); run(r, y, u)
    return y[-4000:].sum(), u[-4000:].sum()
timed(all_parts)
"""
)
LFILTER_LOOP = (
    PLANT
    + """
from scipy.signal import lfilter
# y/u = (g0 z + s g1 - c g0) / (z^2 - 2 c z + c^2 + s^2), u/e = (300.1 z - 300) / (z - 1)
plant, poles = n.array([g0, s * g1 - c * g0]), n.array([1, -2 * c, c * c + s * s])
forward = n.polymul(plant, [300.1, -300.0]); closed = n.polymul(poles, [1.0, -1.0])
closed[1:] += forward
to_u = n.polymul([300.1, -300.0], poles)
def all_parts():
    for _ in range(parts):
        y, u = lfilter(n.concatenate([[0], forward]), closed, r), lfilter(to_u, closed, r)
    return y[-4000:].sum(), u[-4000:].sum()
timed(all_parts)
"""
)


@dataclass
class Measured:
    """What one program took in each round, and what it said last."""

    s: list = field(default_factory=list)
    megabytes: float = 0.0
    said: str = ""


def run(command):
    """Its output, the processor time it took in s, and its largest memory in MB."""
    child = subprocess.Popen(command, stdout=subprocess.PIPE)
    # What was said last is enough, and keeps this program small: its own memory counts until another takes its place.
    said = b""
    while part := child.stdout.read(1 << 16):
        said = (said + part)[-(1 << 16) :]
    said = said.decode(errors="replace")
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        sys.exit(f"rivals: {' '.join(command[:4])}: exit code {child.returncode}")
    return said, used.ru_utime + used.ru_stime, used.ru_maxrss / 1e3


@dataclass
class Table:
    """Programs that do the same work: drift's first, the physical limit second, then the rivals."""

    name: str
    title: str
    count: int
    unit: str
    ours: tuple
    limit: tuple
    rivals: dict
    same: Callable
    # Programs that say how long they took.
    timed_within: tuple = ()

    def measure(self, how_often, with_rivals=True):
        programs = dict([self.ours, self.limit], **(self.rivals if with_rivals else {}))
        measured = {name: Measured() for name in programs}
        for _ in range(how_often):
            for name, command in programs.items():
                of = measured[name]
                of.said, took, of.megabytes = run(command)
                if name in self.timed_within:
                    of.said, _, took = of.said.rpartition(" ")
                of.s.append(float(took))
        self.same({name: of.said for name, of in measured.items()})
        return measured

    def ratio(self, how_often):
        """drift to the physical limit: the median of rounds, in each of which both ran."""
        measured = self.measure(how_often, with_rivals=False)
        pairs = zip(measured[self.ours[0]].s, measured[self.limit[0]].s)
        return statistics.median(ours / limit for ours, limit in pairs)

    def show(self):
        measured = self.measure(rounds)
        medians = {name: statistics.median(of.s) for name, of in measured.items()}
        print(f"\n| {self.title} | s | ns a {self.unit} | to drift | to the limit | MB |\n|---|---|---|---|---|---|")
        for name, took in medians.items():
            ns = took / self.count * 1e9
            drift_s, limit_s = medians[self.ours[0]], medians[self.limit[0]]
            shown = f"{took:.2f} | {ns:.3g} | {took / drift_s:.2f} | {took / limit_s:.2f}"
            print(f"| {name} | {shown} | {measured[name].megabytes:.0f} |", flush=True)
        beside, goal = GOALS[self.name]
        ratio = medians[self.ours[0]] / medians[beside]
        print(f"\nGoal: at most {goal:.2f} times {beside}; {ratio:.2f}, {'reached' if ratio <= goal else 'not reached'}.", flush=True)


def close(said, names, wanted, tolerance):
    """All of these have said the same numbers, but for rounding."""
    for name in (name for name in names if name in said):
        got = [float(word) for word in said[name].split()]
        is_close = len(got) == len(wanted) and all(
            abs(g - w) <= tolerance * max(1.0, abs(w)) for g, w in zip(got, wanted)
        )
        if not is_close:
            sys.exit(f"rivals: {name} says {got}, others {wanted}")


def same_rows(said):
    """Everybody has read the same rows: their count, and the sums of y and u."""
    samples = json.loads(said["drift monitor"].splitlines()[-1])["summary"]["samples"]
    if samples != rows:
        sys.exit(f"rivals: drift read {samples} rows of {rows}")
    names = [name for name in said if name not in ("drift monitor", "cat")]
    wanted = [float(word) for word in said[names[0]].split()]
    if wanted[0] != rows:
        sys.exit(f"rivals: {names[0]} read {wanted[0]} rows of {rows}")
    close(said, names, wanted, 1e-6)


def same_decisions(ours, others):
    def check(said):
        close(said, others, [float(word) for word in said[ours].split()], 1e-5)

    return check


def same_loop(ours):
    def check(said):
        close(said, said, [float(word) for word in said[ours].split()], 1e-6)

    return check


def monitor(file):
    return ("drift monitor", [drift, "monitor", str(file), "--baseline", str(baseline), "--json", "-"])


def by_polars(reader):
    code = f"import sys, polars as p; d = p.{reader}(sys.argv[1]); print(d.height, d['y'].sum(), d['u'].sum())"
    return lambda file: python(code, file)


def by_duckdb(file):
    query = f"select count(t + r), sum(y), sum(u) from '{file}'"
    quiet = "duckdb.sql('set enable_progress_bar = false')"
    return python(f"import sys, duckdb; {quiet}; print(*duckdb.sql(sys.argv[1]).fetchall()[0])", query)


def by_pandas(file):
    code = "import sys, pandas as p; d = p.read_csv(sys.argv[1]); print(len(d), d['y'].sum(), d['u'].sum())"
    return python(code, file)


def by_pyarrow(file):
    code = (
        "import sys, pyarrow.parquet as q, pyarrow.compute as c; d = q.read_table(sys.argv[1], use_threads=False); "
        "print(d.num_rows, c.sum(d['y']).as_py(), c.sum(d['u']).as_py())"
    )
    return python(code, file)


by_hand = ("parser by hand, C, of the CSV", [parser, str(csv)])


def tables():
    """All of them; that of Parquet where it can be read."""
    size = f"{csv.stat().st_size / 1e6:.0f} MB"
    yield Table(
        "monitor, CSV",
        f"`monitor` {rows} rows of CSV ({size})",
        rows,
        "row",
        monitor(csv),
        by_hand,
        {"polars": by_polars("read_csv")(csv), "duckdb": by_duckdb(csv), "pandas": by_pandas(csv), "cat": ["cat", str(csv)]},
        same_rows,
    )
    if mode != "check":
        size = f"{parquet.stat().st_size / 1e6:.0f} MB"
        yield Table(
            "monitor, Parquet",
            f"`monitor` the same in Parquet ({size})",
            rows,
            "row",
            monitor(parquet),
            by_hand,
            {
                "polars": by_polars("read_parquet")(parquet),
                "duckdb": by_duckdb(parquet),
                "pyarrow": by_pyarrow(parquet),
                "cat": ["cat", str(parquet)],
            },
            same_rows,
        )
    polars = python("import sys, polars as p; p.read_csv(sys.argv[1]).write_csv(sys.argv[2])", csv, copy)
    yield Table(
        "simulate, CSV",
        f"`simulate` {rows} rows into CSV",
        rows,
        "row",
        ("drift simulate", [*simulate, str(copy)]),
        by_hand,
        {"polars, reading it as well": polars},
        lambda said: None,
    )
    pair = same_decisions("drift tick", ["sums by hand, Rust"])
    yield Table(
        "tick",
        f"`PairMonitor::tick`, 16 x 250 ticks, {ticks} ticks",
        ticks,
        "tick",
        ("drift tick", [inner, "tick", str(ticks)]),
        ("sums by hand, Rust", [inner, "sums", str(ticks)]),
        {"nexus-stats, MOSUM and CUSUM of one signal": [nexus, str(ticks)]},
        pair,
    )
    names = ["sums by hand, Rust", "numba", "numpy"]
    yield Table(
        "ticks",
        f"`PairMonitor::ticks` on slices, {ticks} ticks",
        ticks,
        "tick",
        ("drift ticks", [inner, "ticks", str(ticks)]),
        ("sums by hand, Rust", [inner, "sums-of-slices", str(ticks)]),
        {"numba": inside(NUMBA_PAIR, ticks), "numpy": inside(NUMPY_PAIR, ticks)},
        same_decisions("drift ticks", names),
        ("numba", "numpy"),
    )
    yield Table(
        "step",
        f"`Simulation::step`, the paper's loop, {steps} steps",
        steps,
        "step",
        ("drift step", [inner, "step", str(steps)]),
        ("the recursion by hand, C", [loop, "step", str(steps)]),
        {"the same in C, its state in memory": [loop, "called", str(steps)]},
        same_loop("drift step"),
    )
    yield Table(
        "simulate",
        f"`simulate()`, the paper's loop, {steps} steps",
        steps,
        "step",
        ("drift simulate()", [inner, "simulate", str(steps)]),
        ("the recursion by hand, C", [loop, "simulate", str(steps)]),
        {"numba": inside(NUMBA_LOOP, steps), "scipy lfilter, y and u": inside(LFILTER_LOOP, steps)},
        same_loop("drift simulate()"),
        ("numba", "scipy lfilter, y and u"),
    )


def processor():
    first = pathlib.Path("/proc/cpuinfo").read_text().split("\n\n")[0].splitlines()
    known = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in first)}
    return ", ".join(known.get(key, "unknown") for key in ("model name", "cpu family", "model", "stepping"))


def record():
    recorded = json.loads(RECORDED.read_text()) if RECORDED.exists() else {}
    recorded[processor()] = {table.name: round(table.ratio(rounds * 2), 3) for table in tables()}
    RECORDED.write_text(json.dumps(recorded, indent=2) + "\n")
    print(RECORDED.read_text(), end="")


def recorded_ratios():
    """Each row's ratio, and how much more than that is allowed."""
    recorded = json.loads(RECORDED.read_text())
    here = processor()
    if here in recorded:
        return recorded[here], ALLOWED
    print(f"rivals: {RECORDED} has nothing of this processor ({here}): the greatest ratio of any other is held")
    ratios = list(recorded.values())
    return {name: max(of[name] for of in ratios) for name in ratios[0]}, ALLOWED_ELSEWHERE


def check():
    """Each row against its recorded ratio; one that seems worse is measured again, longer, and the least counts: a busy machine is no loss."""
    recorded, allowed = recorded_ratios()
    worse = []
    for table in tables():
        wanted = recorded[table.name]
        ratio = table.ratio(rounds)
        for _ in range(2):
            if ratio > allowed * wanted:
                ratio = min(ratio, table.ratio(3 * rounds))
        print(f"{table.name}: {ratio:.2f} times {table.limit[0]}, recorded {wanted:.2f}", flush=True)
        if ratio > allowed * wanted:
            worse.append(f"{table.name} takes {ratio / wanted:.2f} times as long as recorded")
    if worse:
        sys.exit("rivals: " + "; ".join(worse) + f"; at most {allowed} (.ci/rivals --record where that is meant)")


run([*simulate, str(csv)])
run([*SIMULATE, "--duration", "2000", "-o", str(copy)])
run([drift, "calibrate", str(copy), "-o", str(baseline), "--window", "3"])
if mode != "check":
    write = "import sys, pyarrow.csv as c, pyarrow.parquet as q; q.write_table(c.read_csv(sys.argv[1]), sys.argv[2])"
    run(python(write, csv, parquet))
if mode == "tables":
    for table in tables():
        table.show()
elif mode == "record":
    record()
else:
    check()
