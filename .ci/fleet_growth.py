#!/usr/bin/env python3
"""How a fleet's time and memory grow: `fleet_growth.py PROGRAMS [LOOPSxSAMPLES ...]`. PROGRAMS is the folder of drift-fleet and of the example
make_plant. Prints the table of docs/fleets.md on stdout: monitor and scan, beside the same rows that are only averaged. Fails where memory grows by more
than a fifth with the rows of each loop, or the time of the processor by more than a fifth beyond the rows (from 3 s on: below, starting counts).
Time is the processor's, so that what else runs on the machine does not count. LOOPSxSAMPLES: so many loops with so many samples each.
"""
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile

# The loops of make_plant that differ, and what they are calibrated from.
KINDS, HEALTHY = 20, 13000
# What `.ci/fleet measure` prints: 1e7 and 1e8 samples in all, of one loop and of ten thousand.
SIZES = ["1x10000000", "1x100000000", "100x100000", "100x1000000", "10000x1000", "10000x10000"]
# Beyond that starting, and what rounding of a clock makes of it, is no part of the growth.
START_S = 3
MOST = 1.2
PLAIN = "SELECT loop, count(t), avg(r), avg(y), avg(u) FROM samples GROUP BY loop"


def used(*command):
    """Seconds of the processor and the most memory, MB, of a command."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    child = subprocess.Popen([str(part) for part in command], stdout=subprocess.DEVNULL)
    _, status, of_child = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        sys.exit(f"failed: {command}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return seconds, of_child.ru_maxrss / 1024


def baselines_of(fleet, folder, loops):
    """A baseline for each loop: those of the loops that differ, copied."""
    learnt = folder / "baselines"
    command = [fleet, "calibrate", folder / "healthy.parquet", "--loop-column", "tag", "--window", "100", "-o", learnt]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    for number in range(KINDS, loops):
        shutil.copyfile(learnt / f"FIC-{number % KINDS:05}.toml", learnt / f"FIC-{number:05}.toml")
    return learnt


def measured(fleet, make, loops, samples):
    """Seconds and MB of the monitor, of the scan, and of the same rows without either."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        subprocess.run([make, folder, str(loops), str(HEALTHY), str(samples)], check=True)
        baselines = baselines_of(fleet, folder, loops)
        reading = [folder / "later.parquet", "--loop-column", "tag", "--sorted"]
        monitor = used(fleet, "monitor", *reading, "--baselines", baselines)
        scan = used(fleet, "scan", *reading)
        plain = used(fleet, "sql", *reading, "--query", PLAIN)
        return {"monitor": monitor, "scan": scan, "average": plain}


def check(rows):
    """Of equally many loops with more rows each: linear time, flat memory."""
    failed = []
    for loops, samples, of_few in rows:
        for of_loops, more, of_many in rows:
            if of_loops != loops or more <= samples:
                continue
            for name, (seconds, memory) in of_few.items():
                longer, larger = of_many[name]
                what = f"{name}, {loops} loops: from {samples} to {more} samples each"
                if larger > MOST * memory:
                    failed.append(f"{what} memory grows from {memory:.0f} to {larger:.0f} MB")
                if longer > MOST * more / samples * max(seconds, START_S):
                    failed.append(f"{what} time grows from {seconds:.1f} to {longer:.1f} s")
    return failed


def main():
    programs = pathlib.Path(sys.argv[1])
    fleet, make = programs / "drift-fleet", programs / "examples" / "make_plant"
    print("| loops | samples in all | monitor: s | ns a sample | MB | scan: s | ns a sample | MB | only averaged: s | ns a sample | MB |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    rows = []
    for size in sys.argv[2:] or SIZES:
        loops, samples = map(int, size.split("x"))
        row = measured(fleet, make, loops, samples)
        rows.append((loops, samples, row))
        cells = (f"{seconds:.1f} | {1e9 * seconds / (loops * samples):.0f} | {memory:.0f}" for seconds, memory in row.values())
        print(f"| {loops} | {loops * samples:.0e} | {' | '.join(cells)} |".replace("e+0", "e"), flush=True)
    if failed := check(rows):
        sys.exit("fleet_growth: " + "; ".join(failed))


main()
