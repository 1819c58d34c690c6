#!/usr/bin/env python3
"""Whether the experiments that `drift plan` proposes name what a recording left open: on cases of the sibling generator's wide.py.

usage: planned.py GENERATOR OUT --tool drift [--seed N] [--count N] [--know WORD,...] [--excite WORD,...] [--samples N] [--json FILE]

Of each case's train.csv a part is diagnosed, N samples from the beginning, or about the onset of what is hidden. Where the verdict is located or undecided, `drift plan` proposes a reference within the loop's usual range of r; the
generator, which is independent of this project, goes on with the case's own simulation over it (its effect, its process noise and its
sensor's noise among it), and the result is diagnosed as the plan says. Right and wrong are judged as score.py does. Where nothing is hidden, nothing may
be named. Prints one line a case, then the table.
"""
import argparse
import json
import os
import runpy
import subprocess
import sys

import numpy as np

# The longest experiment, in lengths of the recording.
LONGEST = 2
HERE = os.path.dirname(os.path.abspath(__file__))


def make(asked):
    """The cases, as make_wide.py makes them, and run.npz beside each: what its train.csv was simulated from."""
    sys.path.insert(0, asked.generator)
    import generate as g
    import wide

    simulate, write_csv, family = g.simulate, g.write_csv, wide.family
    runs, usual = [], {}

    def kept_family(rng, fam):
        drawn = family(rng, fam)
        runs.clear()
        usual.clear()
        return drawn

    def kept(fam, r, ts, sub, pl, ct, ef, noise, u0, y0, process=None):
        out = simulate(fam, r, ts, sub, pl, ct, ef, noise, u0, y0, process)
        # The first run of a case is its usual motion.
        usual.setdefault("r", np.array(r))
        runs.append((out[0], dict(fam=fam, r=np.array(r), ts=ts, sub=sub, pl=pl, ct=ct, ef=np.array(ef), noise=np.array(noise), u0=u0, y0=y0,
                                  process=np.zeros(len(r)) if process is None else np.array(process))))
        return out

    def written(path, ts, r, y, u):
        write_csv(path, ts, r, y, u)
        if os.path.basename(path) == "train.csv":
            run = next(run for of, run in reversed(runs) if of is y)
            np.savez(os.path.join(os.path.dirname(path), "run.npz"), usual_low=usual["r"].min(), usual_high=usual["r"].max(), **run)

    g.simulate, g.write_csv, wide.family = kept, written, kept_family
    sys.argv = ["make_wide.py", asked.generator, asked.out, "--seed", str(asked.seed), "--count", str(asked.count), "--know", asked.know, "--excite", asked.excite]
    runpy.run_path(os.path.join(HERE, "make_wide.py"), run_name="__main__")
    g.simulate, g.write_csv = simulate, write_csv
    return g


def gone_on(rng, past, samples):
    """A first-order sequence of the deviation and the memory of the past one, from its last value on."""
    deviation = np.std(past)
    if deviation == 0:
        return np.zeros(samples)
    memory = float(np.clip(np.mean(past[1:] * past[:-1]) / np.mean(past * past), 0, 1))
    out, last = np.empty(samples), past[-1]
    for n in range(samples):
        last = memory * last + deviation * np.sqrt(1 - memory**2) * rng.standard_normal()
        out[n] = last
    return out


def part_of(run, label, samples):
    """From and to which sample of a case's run its recording is."""
    onset = int(label["onset_s"] / float(run["ts"]))
    first = min(max(onset - samples // 2, 0), max(len(run["r"]) - samples, 0))
    return first, min(first + samples, len(run["r"]))


def cut(case, first, last):
    """The part of train.csv as a recording of its own."""
    with open(os.path.join(case, "train.csv")) as file:
        head, rows = file.readline(), file.readlines()[first:last]
    start = float(rows[0].split(",")[0])
    with open(os.path.join(case, "now.csv"), "w") as file:
        file.write(head)
        for row in rows:
            t, rest = row.split(",", 1)
            file.write(f"{float(t) - start:.9g},{rest}")


def played(g, run, last, reference, out, before_s, seed):
    """Goes on with a case over the reference's r; writes the experiment, and the log before it that is to be diagnosed with it."""
    rng = np.random.default_rng(seed)
    r = np.loadtxt(reference, delimiter=",", skiprows=1, usecols=1)
    old, ts = last, float(run["ts"])
    joined = np.concatenate([run["r"][:old], r])
    noise, process = (np.concatenate([run[name][:old], gone_on(rng, run[name][:old], len(r))]) for name in ("noise", "process"))
    y, u, _ = g.simulate(int(run["fam"]), joined, ts, int(run["sub"]), run["pl"], run["ct"], run["ef"], noise, float(run["u0"]), float(run["y0"]), process)
    first = max(old - int(round(before_s / ts)), 0)
    g.write_csv(out, ts, joined[first:], y[first:], u[first:])


def diagnosed(tool, case, recording, out):
    subprocess.run([tool, "diagnose", recording, "--loop", os.path.join(case, "loop.toml"), "--json", out], capture_output=True, text=True, timeout=600)
    return json.load(open(out)) if os.path.exists(out) else None


def outcome(label, found):
    """As score.py: the first name, or one that is said to be the same here, of what is there."""
    if found is None:
        return "error"
    first = (found["physics"] or [None])[0]
    there = {label["kind"], label.get("also")} - {None, "none"}
    if found["verdict"] != "missing_physics" or first is None:
        return "not named" if there else "right"
    ties = first["indistinguishable_from"]
    fits = first["kind"] in there or (there & set(ties) and len(ties) <= 3)
    return "right" if fits else "wrong"


def experiment(g, asked, name, label):
    """None where the case's recording tells by itself."""
    case = os.path.join(asked.out, name)
    at = lambda file: os.path.join(case, file)
    run = dict(np.load(at("run.npz")))
    begin, end = part_of(run, label, asked.samples)
    cut(case, begin, end)
    first = diagnosed(asked.tool, case, at("now.csv"), at("first.json"))
    if first is None or first["verdict"] not in ("located", "undecided"):
        return None
    ts, now = float(run["ts"]), float(run["r"][end - 1])
    low, high = min(float(run["usual_low"]), now), max(float(run["usual_high"]), now)
    planned = subprocess.run([asked.tool, "plan", at("loop.toml"), "--diagnosis", at("first.json"), "-o", at("reference.csv"), "--json", at("plan.json"),
                              "--r-min", repr(low), "--r-max", repr(high), "--duration", repr(LONGEST * (end - begin) * ts)], capture_output=True, text=True, timeout=900)
    row = dict(case=name, kind=label["kind"], also=label.get("also"), know=label["know"], excite=label["excite"], silent=label["silent"], verdict=first["verdict"])
    if planned.returncode:
        return dict(row, outcome="no plan", why=planned.stderr.strip().splitlines()[-1])
    plan = json.load(open(at("plan.json")))
    played(g, run, end, at("reference.csv"), at("experiment.csv"), plan["before_s"], asked.seed)
    found = diagnosed(asked.tool, case, at("experiment.csv"), at("second.json"))
    named = [[p["kind"], *p["indistinguishable_from"]] for p in (found or {}).get("physics", [])]
    return dict(row, outcome=outcome(label, found), named=named, then=(found or {}).get("verdict"), chance=plan["chance"], reference=plan["reference"],
                seconds=plan["duration_s"], old_seconds=(end - begin) * ts, before_s=plan["before_s"], not_told=plan["not_told_apart"])


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("generator")
    parser.add_argument("out")
    parser.add_argument("--tool", required=True)
    parser.add_argument("--seed", type=int, default=9100)
    parser.add_argument("--count", type=int, default=36)
    parser.add_argument("--know", default="model,rough,law")
    parser.add_argument("--excite", default="usual,steps,small,rest,one-step")
    parser.add_argument("--samples", type=int, default=2000)
    parser.add_argument("--json")
    asked = parser.parse_args()
    g = make(asked)
    labels = json.load(open(os.path.join(asked.out, "labels.json")))
    rows = []
    for name, label in labels.items():
        row = experiment(g, asked, name, label)
        if row:
            rows.append(row)
            print(json.dumps(row), flush=True)
            if asked.json:
                json.dump(rows, open(asked.json, "w"), indent=1)
    print(f"{len(labels)} cases, {len(rows)} left open by their recording; after the planned experiment:")
    for promised, chosen in (("all", rows), ("chance of at least 90 %", [row for row in rows if row.get("chance", 0) >= 0.9])):
        of = {word: sum(row["outcome"] == word for row in chosen) for word in ("right", "wrong", "not named", "no plan", "error")}
        print(f"{promised:26s} {len(chosen):4d}  " + "  ".join(f"{word} {n}" for word, n in of.items()))


main()
