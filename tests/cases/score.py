"""Runs `drift diagnose` on made cases and scores it against their labels, in the same words as the sibling generator's scorer.

right: the first named kind, or one of at most three that it is tied with, is there. there: what the noise of the process or the
sensor's lattice truly is counts neither for nor against.
"""
import json
import os
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from answered_unit import truth_as_answered, unknown_drive
from kinds import place
from oracle import missed, oracle

LONGEST_S = 600
MOST_TIES = 3
# Kinds whose first number may come with the other sign: the phase makes up for it.
EITHER_SIGN = {"cogging", "gravity"}


def fit_pct(of, by):
    return 100 * (1 - np.linalg.norm(of - by) / max(np.linalg.norm(of - of.mean()), 1e-300))


def columns(path):
    return np.loadtxt(path, delimiter=",", skiprows=1, usecols=(0, 1, 2, 3)).T


def fit_of_u(tool, folder, model):
    """How well a loop file's closed loop gives the u of the hold-out; None where it can't be simulated."""
    out, holdout = os.path.join(folder, "simulated.csv"), os.path.join(folder, "holdout.csv")
    try:
        done = subprocess.run([*tool, "simulate", os.path.join(folder, model), "--reference", holdout, "-o", out], capture_output=True, timeout=LONGEST_S)
    except subprocess.TimeoutExpired:
        return None
    return None if done.returncode else fit_pct(columns(holdout)[3], columns(out)[3])


def diagnose(tool, folder):
    """(the JSON or None, seconds, the error or None)."""
    at = {name: os.path.join(folder, name) for name in ("train.csv", "loop.toml", "holdout.csv", "healthy.csv", "diagnosis.json", "improved.toml")}
    for stale in ("diagnosis.json", "improved.toml"):
        if os.path.exists(at[stale]):
            os.remove(at[stale])
    command = [*tool, "diagnose", at["train.csv"], "--loop", at["loop.toml"], "--holdout", at["holdout.csv"], "--json", at["diagnosis.json"], "--model", at["improved.toml"]]
    command += ["--healthy", at["healthy.csv"]] if os.path.exists(at["healthy.csv"]) else []
    began = time.time()
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST_S)
    except subprocess.TimeoutExpired:
        return None, float(LONGEST_S), f"more than {LONGEST_S} s"
    took = time.time() - began
    if done.returncode or not os.path.exists(at["diagnosis.json"]):
        return None, took, (done.stderr.strip().splitlines() or ["no output"])[-1][:200]
    with open(at["diagnosis.json"]) as file:
        return json.load(file), took, None


def judge(found, label, drive=None):
    """The scores that need the diagnosis, the label and the drive (answered_unit) alone."""
    out = dict(verdict=found.get("verdict"))
    there = set(label.get("there") or []) - {label["kind"], label.get("also")}
    named = [p for p in found.get("physics") or [] if p["kind"] not in there]
    first = named[0] if named and out["verdict"] == "missing_physics" else None
    out.update(named=first and first["kind"], ties=list(first.get("indistinguishable_from") or []) if first else [])
    if label["kind"] == "none" or label.get("silent"):
        a_load = any(place(kind) == "disturbance" for kind in there) and found.get("place") == "disturbance"
        true_but_silent = bool(label.get("silent") and first and first["kind"] == label["kind"])
        out["false_alarm"] = (bool(named) or (out["verdict"] == "located" and not a_load)) and not true_but_silent
        return out
    true = {label["kind"], label.get("also")} - {None}

    def fits(p):
        ties = p.get("indistinguishable_from") or []
        return p["kind"] in true or bool(true & set(ties)) and len(ties) <= MOST_TIES

    out.update(decided=first is not None, exact=bool(first) and first["kind"] == label["kind"], right=bool(first and fits(first)))
    out.update(wrong_beside=sum(not fits(p) for p in named[1:]) if first else 0, place_right=found.get("place") == label["place"])
    out["both"] = bool(first) and len(true) == 2 and sum(fits(p) for p in named) >= 2
    if label["onset_s"] > 0 and found.get("onset_s") is not None:
        out["onset_error_s"] = abs(found["onset_s"] - label["onset_s"])
    if out["exact"]:
        out.update(numbers(first, label, drive))
    return out


def numbers(named, label, drive=None):
    """The worst relative error of the named kind's numbers, and which of their intervals cover the truth, in the unit of the answer."""
    got = {p["name"]: p for p in named.get("parameters", [])}
    errors, covers = [], []
    for name, true in label["params"].items():
        if name not in got or not true:
            errors.append(float("inf"))
            continue
        true = truth_as_answered(true, got[name], drive, label["place"])
        value, interval = got[name]["value"], got[name].get("ci95")
        if label["kind"] in EITHER_SIGN and value * true < 0:
            value, interval = -value, interval and [-interval[1], -interval[0]]
        errors.append(abs(value - true) / abs(true))
        if interval:
            covers.append(bool(interval[0] <= true <= interval[1]))
    return dict(param_error=max(errors) if errors else None, ci_covers=covers)


def score(tool, folder, label):
    """One case."""
    quiet = label["kind"] == "none" or label.get("silent")
    out = {key: label.get(key) for key in ("family", "know", "excite", "also", "noise")}
    out["label"] = "none" if quiet else label["kind"]
    found, took, error = diagnose(tool, folder)
    out["seconds"] = took
    if error:
        return dict(out, error=error)
    out.update(judge(found, label, unknown_drive(folder)))
    if not quiet and os.path.exists(os.path.join(folder, "improved.toml")):
        before, after = (fit_of_u(tool, folder, model) for model in ("loop.toml", "improved.toml"))
        if before is not None and after is not None:
            out["recovered"] = (after - before) / max(label["holdout_truth_u_pct"] - before, 1e-9)
    if missed(out):
        out["oracle"], out["truth_ahead"] = oracle(tool, folder)
    return out


def score_all(tool, cases, labels, jobs):
    with ThreadPoolExecutor(jobs) as workers:
        return dict(zip(labels, workers.map(lambda name: score(tool, os.path.join(cases, name), labels[name]), labels)))
