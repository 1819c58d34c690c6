#!/usr/bin/env python3
"""How a fleet's time and memory grow: `fleet_growth.py PROGRAMS [LOOPSxSAMPLES ...]`. PROGRAMS is the folder of drift-fleet and of the example
make_plant. Prints the table of docs/fleets.md on stdout; fails where memory grows with the rows of a loop by more than a fifth, or the time
of the processor by more than a fifth beyond the rows (from 3 s on: below, starting counts). Time is the processor's, so that what else
runs on the machine does not count. LOOPSxSAMPLES: so many loops with so many samples each.
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
# Beyond that starting, and what rounding of a clock makes of it, is no part of the growth.
START_S = 3


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
    """One row: seconds and MB of the monitor, seconds and MB of the same scan without it."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        subprocess.run([make, folder, str(loops), str(HEALTHY), str(samples)], check=True)
        baselines = baselines_of(fleet, folder, loops)
        reading = [folder / "later.parquet", "--loop-column", "tag", "--sorted"]
        monitor = used(fleet, "monitor", *reading, "--baselines", baselines)
        plain = "SELECT loop, count(t), avg(r), avg(y), avg(u) FROM samples GROUP BY loop"
        scan = used(fleet, "sql", *reading, "--query", plain)
        return *monitor, *scan


def main():
    programs = pathlib.Path(sys.argv[1])
    sizes = sys.argv[2:] or ["20x50000", "20x500000", "200x5000", "200x50000"]
    fleet, make = programs / "drift-fleet", programs / "examples" / "make_plant"
    print("| loops | samples in all | processor, s | a sample, ns | memory, MB | the same rows, only averaged: s, MB |")
    print("|---|---|---|---|---|---|")
    rows = []
    for size in sizes:
        loops, samples = map(int, size.split("x"))
        seconds, memory, scan, scan_memory = measured(fleet, make, loops, samples)
        rows.append((loops, samples, seconds, memory))
        all_of_them = f"{loops * samples:.0e}".replace("e+0", "e")
        print(
            f"| {loops} | {all_of_them} | {seconds:.1f} | {1e9 * seconds / (loops * samples):.0f} | {memory:.0f} "
            f"| {scan:.1f}, {scan_memory:.0f} |",
            flush=True,
        )
    for loops, samples, seconds, memory in rows:
        for of_loops, more, longer, larger in rows:
            if of_loops == loops and more > samples:
                assert larger < 1.2 * memory, f"memory grows with the rows: {memory:.0f} and {larger:.0f} MB"
                allowed = 1.2 * more / samples * max(seconds, START_S)
                assert longer < allowed, f"time is not linear: {seconds:.1f} s, and {longer:.1f} s of {more / samples:.0f} times the rows"


main()
