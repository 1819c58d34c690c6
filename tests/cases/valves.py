#!/usr/bin/env python3
"""Makes loops at rest as a plant's archive keeps them (set point, measured value, output), with a valve that sticks or plays or with something else that makes them swing, runs
`drift diagnose` on them with nothing known of law and plant, and prints what is named. usage: valves.py SEED... [--count 48] [--jobs 2] [--keep DIR] --tool "PATH/TO/drift"

The valves: `sticks` stays until u is half a band away and goes to within half the band less half the jump of it, where it sticks again (He, Wang, Pottmann, Qin 2007); `slides` goes on
with u from there until u turns (Choudhury, Thornhill, Shah 2005); `plays` follows at the edge of the band. Slips scatter by up to 6 % of the band. What swings otherwise: a loop at the
edge of stability, one wave or two from outside, a sensor that plays, noise alone.
"""
import argparse
import collections
import json
import os
import shlex
import subprocess
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numba as nb
import numpy as np

from noises import recursion

FAULTY, SOUND = ("sticks", "slides", "sticks", "plays"), ("tight", "wave", "noise", "sensor", "waves")
PLAY = {"stiction", "backlash"}
# What the others truly are: to name it is right.
TRUE = {"wave": {"periodic_load"}, "waves": {"periodic_load"}, "sensor": {"sensor_hysteresis", "quantization"}}
FLOW, LEVEL, TEMPERATURE = range(3)
STEPS = 10  # of the plant within a sample
LEAST_TURNS = 5  # a valve that turned less often shows too little
TRIES = 40


@nb.njit(cache=True)
def run(family, plant, law, valve, drawn, load, wave, sensor_gap, lattice):
    """(y, u, times that the stem turned) of a loop at rest around 0; plant: gain, lag, second lag, dead time; law: gain, integral time; valve: band, jump, how it
    moves; lags and times in samples."""
    gain, lag, second, late = plant
    kc, ti = law
    band, jump, moves = valve
    noise, slips = drawn
    n = len(noise)
    y, u = np.empty(n), np.empty(n)
    x = np.zeros(2)
    integral, stem, shown = 0.0, 0.25 * band, 0.0
    moving, last, turns, slips_at = 0.0, 0.0, 0, 0.5 * band
    pipe = np.full(int(round(late * STEPS)) + 1, stem)
    head = 0
    for k in range(n):
        measured = (x[1] if family == TEMPERATURE else x[0]) + noise[k]
        if sensor_gap > 0:
            shown = min(max(shown, measured - sensor_gap), measured + sensor_gap)
            measured = shown
        if lattice > 0:
            measured = lattice * np.round(measured / lattice)
        error = -measured * np.sign(gain)
        integral += kc * error / ti
        out = integral + kc * error
        y[k], u[k] = measured, out
        off = out - stem
        if moves == 0:
            stem = out
        elif moving != 0 and moves == 2:
            follows = out - moving * 0.5 * (band - jump)
            if (follows - stem) * moving > 0:
                stem = follows
            else:
                moving = 0.0
        elif abs(off) > slips_at:
            way = np.sign(off)
            turns += way != last
            last = way
            stem = out - way * 0.5 * (band - jump)
            slips_at = 0.5 * band * (1 + slips[k])
            moving = way if moves == 2 else 0.0
        for _ in range(STEPS):
            pipe[head] = stem + load[k] + wave[k]
            head = (head + 1) % len(pipe)
            drive = pipe[head]
            if family == LEVEL:
                x[0] += gain * drive / lag / STEPS
            else:
                x[0] += (1 - np.exp(-1 / (STEPS * lag))) * (gain * drive - x[0])
                x[1] += (1 - np.exp(-1 / (STEPS * second))) * (x[0] - x[1])
        if not abs(x[0]) < 1e5:
            break
    return y, u, turns


def correlated(random, n, deviation, stays):
    return recursion(deviation * np.sqrt(1 - stays**2) * random.standard_normal(n), float(stays), 0.0)


def plant_and_law(random, family):
    """A plant (gain, lag, second lag, dead time) and the law that its lag asks for (Skogestad's rules, slower by up to four times)."""
    gain = random.uniform(0.5, 3) * random.choice([1, 1, 1, -1])
    if family == FLOW:
        lag, late = random.uniform(0.3, 6), random.uniform(0, 2)
    elif family == LEVEL:
        lag, late = random.uniform(20, 150), random.uniform(0, 2)
    else:
        lag, late = random.uniform(8, 40), random.uniform(1, 8)
    second = lag * random.uniform(0.1, 0.5) if family == TEMPERATURE else 1.0
    if family == LEVEL:
        closed = random.uniform(6, 20) + 2 * late
        return (gain, lag, second, late), (lag / (closed * abs(gain)), 4 * closed)
    closed = random.uniform(1.5, 4) * (lag + late)
    return (gain, lag, second, late), (max(lag, 0.5) / (abs(gain) * (closed + late)), max(lag, 1.0) * random.uniform(0.8, 2))


def at_the_edge(kc, swings):
    """The largest gain of the law with which the loop does not swing more and more."""
    low, high = kc, 100 * kc
    for _ in range(12):
        middle = np.sqrt(low * high)
        low, high = (low, middle) if swings(middle) else (middle, high)
    return 0.9 * low


def made(seed, index, again):
    """One loop and what it hides; None where too little of it shows."""
    random = np.random.default_rng([seed, index, again])
    hides = FAULTY[index // 2 % len(FAULTY)] if index % 2 == 0 else SOUND[index // 2 % len(SOUND)]
    family = random.choice([FLOW, FLOW, LEVEL, TEMPERATURE])
    n = int(random.choice([750, 1000, 1500]))
    plant, (kc, ti) = plant_and_law(random, family)
    band = random.uniform(0.3, 5)
    jump = 0.0 if hides == "plays" else band * random.uniform(0.2, 1.0)
    size = abs(plant[0]) * band * (0.3 if family == LEVEL else 1)
    noise = correlated(random, n, size * random.choice([0.01, 0.03, 0.08]), random.choice([0, 0.5, 0.8]))
    slips = random.choice([0, 0.01, 0.03, 0.06]) * random.standard_normal(n)
    loads = 0.1 if hides == "sensor" else random.choice([0, 0.01, 0.04])
    load = correlated(random, n, band * loads, np.exp(-1 / random.uniform(20, 200)))
    at = 2 * np.pi * np.arange(n) / random.uniform(15, 120)
    wave = np.zeros(n)
    if hides in ("wave", "waves"):
        wave = 0.5 * band * np.sin(at) + (0.15 * band * np.sin(2.7 * at + 1) if hides == "waves" else 0)
    moves = {"sticks": 1, "plays": 2, "slides": 2}.get(hides, 0)
    gap = 0.15 * abs(plant[0]) * band if hides == "sensor" else 0.0
    lattice = size * random.choice([0, 0, 0.003])

    def of(kc):
        return run(family, plant, (kc, ti), (band, jump, moves), (noise, slips), load, wave, gap, lattice)

    def swings(kc):
        u = of(kc)[1]
        return not np.all(np.isfinite(u)) or np.std(u[n // 2 :]) > 3 * max(np.std(u[: n // 4]), 1e-9)

    y, u, turns = of(at_the_edge(kc, swings) if hides == "tight" else kc)
    if not np.all(np.isfinite(u)) or np.ptp(u) < 1e-6 or (moves and turns < LEAST_TURNS):
        return None
    return hides, y + random.uniform(20, 150), u + random.uniform(20, 80), 1.0 if family == FLOW else 10.0


def make(seed, index, out):
    loop = next(filter(None, (made(seed, index, again) for again in range(TRIES))), None)
    if loop is None:
        sys.exit(f"valves: no loop {index} of seed {seed} in {TRIES} tries")
    hides, y, u, every_s = loop
    folder = os.path.join(out, f"case{index:04d}")
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, "train.csv"), "w") as file:
        file.write("t,r,y,u\n")
        file.writelines(f"{k * every_s:g},{y.mean():.5f},{a:.5f},{b:.5f}\n" for k, (a, b) in enumerate(zip(y, u)))
    with open(os.path.join(folder, "loop.toml"), "w") as file:
        file.write(f'[loop]\nsample_time_s = {every_s}\n[controller]\nkind = "recorded"\n[plant]\nkind = "identify"\n')
    with open(os.path.join(folder, "label.json"), "w") as file:
        json.dump({"hides": hides}, file)


def score(tool, folder):
    """(what it hides, how it was answered, what was named)."""
    with open(os.path.join(folder, "label.json")) as file:
        hides = json.load(file)["hides"]
    report = os.path.join(folder, "diagnosis.json")
    command = [*tool, "diagnose", os.path.join(folder, "train.csv"), "--loop", os.path.join(folder, "loop.toml"), "--json", report]
    ended = subprocess.run(command, capture_output=True, text=True)
    if ended.returncode:
        return hides, "error", ended.stderr.strip()[-100:]
    with open(report) as file:
        found = json.load(file)
    named = found.get("physics") or []
    if found["verdict"] != "missing_physics" or not named:
        return hides, "open", found["verdict"]
    kinds = {named[0]["kind"], *named[0]["indistinguishable_from"]}
    is_right = bool(kinds & (PLAY if hides in FAULTY else TRUE.get(hides, set())))
    return hides, "right" if is_right else "wrong", named[0]["kind"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("seeds", nargs="+", type=int)
    parser.add_argument("--count", type=int, default=48)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--keep")
    parser.add_argument("--tool", required=True)
    of = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="drift-valves-") as scratch:
        made_and_scored(of, of.keep or scratch)


def made_and_scored(of, out):
    # Compiled once, before the processes ask for it.
    run(FLOW, (1.0, 1.0, 1.0, 0.0), (0.1, 9.0), (1.0, 0.5, 1), (np.zeros(9), np.zeros(9)), np.zeros(9), np.zeros(9), 0.0, 0.0)
    each = [(seed, index, os.path.join(out, str(seed))) for seed in of.seeds for index in range(of.count)]
    with ProcessPoolExecutor(of.jobs) as pool:
        list(pool.map(make, *zip(*each)))
    folders = [os.path.join(folder, f"case{index:04d}") for _, index, folder in each]
    with ThreadPoolExecutor(of.jobs) as pool:
        scores = list(pool.map(lambda folder: score(shlex.split(of.tool), folder), folders))
    for folder, (hides, answer, named) in zip(folders, scores):
        if of.keep or answer in ("wrong", "error"):
            print(f"{os.path.relpath(folder, out)}: {hides}, {answer}: {named}")
    print("| hidden | loops | right | wrong | open |\n|---|---|---|---|---|")
    counts = collections.Counter((hides, answer) for hides, answer, _ in scores)
    for hides in dict.fromkeys([*FAULTY, *SOUND]):
        row = [counts[hides, answer] for answer in ("right", "wrong", "open", "error")]
        print(f"| {hides} | {sum(row)} | {row[0]} | {row[1]} | {row[2] + row[3]} |")


if __name__ == "__main__":
    main()
