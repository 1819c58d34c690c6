#!/usr/bin/env python3
"""Prints the table of scored cases (of either scorer). usage: table.py SCORES.json..."""
import collections
import json
import sys

import numpy as np

ROWS = {"know": "what is known", "excite": "motion", "noise": "process noise", "family": "family"}
GOALS = {"model": "92 %", "rough": "90 %", "plant": "88 %"}
ENOUGH = 40  # intervals of a row from which on their coverage says something


def share(part, whole):
    return f"{part} of {whole} ({100 * part / whole:.1f} %)" if whole else "-"


class Rows:
    """The counts of some cases."""

    def __init__(self, cases):
        self.cases = cases
        self.real = [case for case in cases if case["label"] != "none"]
        self.clean = [case for case in cases if case["label"] == "none"]
        self.named = [case for case in self.real if case.get("decided")]
        self.right = [case for case in self.named if case.get("right")]
        self.wrong = len(self.named) - len(self.right)
        self.false = sum(bool(case.get("false_alarm")) for case in self.clean)
        self.covers = [hit for case in self.real for hit in case.get("ci_covers", [])]
        self.errors = sum("error" in case for case in cases)

    def coverage(self):
        return f"{100 * np.mean(self.covers):.0f} % of {len(self.covers)}" if len(self.covers) >= ENOUGH else "-"


def by(cases, key):
    """The rows of a key, the values in order of their first case."""
    groups = collections.OrderedDict()
    for case in cases:
        if case.get(key):
            groups.setdefault(case[key], []).append(case)
    return {value: Rows(group) for value, group in groups.items()}


def main_table(cases):
    everything = Rows(cases)
    two = [case for case in everything.real if case.get("also") and "error" not in case]
    seconds = [case["seconds"] for case in cases if "seconds" in case]
    beside = sum(case.get("wrong_beside", 0) for case in everything.right)
    yield "| figure | goal | reached |\n|---|---|---|"
    yield f"| wrong of named | 2 % | {share(everything.wrong, len(everything.named))} |"
    for key in ("know", "excite"):
        for value, rows in by(cases, key).items():
            yield f"| wrong of named: {value} | 5 % | {share(rows.wrong, len(rows.named))} |"
    yield f"| false alarms on clean ones | 1 % | {share(everything.false, len(everything.clean))} |"
    for value, rows in by(cases, "know").items():
        yield f"| right of all: {value} | {GOALS.get(value, '')} | {share(len(rows.right), len(rows.real))} |"
    yield f"| the second effect named too, where there is one | 60 % | {share(sum(bool(case.get('both')) for case in two), len(two))} |"
    yield f"| wrong names beside a right one | 2 % | {share(beside, len(everything.right))} |"
    yield f"| coverage of the 95 % intervals | 90-99 % | {everything.coverage()} |"
    if seconds:
        yield f"| time: median, longest | 2 s, 10 s | {np.median(seconds):.1f} s, {max(seconds):.1f} s |"
    yield f"| runs that end in an error | 0 | {everything.errors} of {len(cases)} |"


def group_table(cases, key):
    yield f"\n| {ROWS[key]} | effects | right | wrong | not named | clean | false alarms | coverage | errors |\n|---|---|---|---|---|---|---|---|---|"
    for value, rows in by(cases, key).items():
        yield (f"| {value} | {len(rows.real)} | {len(rows.right)} | {rows.wrong} | {len(rows.real) - len(rows.named)} | {len(rows.clean)} | {rows.false} | "
               f"{rows.coverage()} | {rows.errors} |")


def oracle_table(cases):
    asked = [case for case in cases if case.get("oracle")]
    kinds = [("wrong", lambda c: c.get("decided")), ("not named", lambda c: not c.get("decided") and not c.get("false_alarm")), ("false alarm", lambda c: c.get("false_alarm"))]
    yield "\n| missed | search | simulator | information | oracle: - |\n|---|---|---|---|---|"
    for name, chosen in kinds:
        words = collections.Counter(case["oracle"] for case in asked if chosen(case))
        yield f"| {name} | {words['search']} | {words['simulator']} | {words['information']} | {words['-']} |"


def misses(runs):
    """One line for each case that is wrong, missed, a false alarm or ends in an error."""
    for run in runs:
        for name, case in run["cases"].items():
            if case.get("right") or (case["label"] == "none" and not case.get("false_alarm") and "error" not in case):
                continue
            got = case.get("error") or ", ".join([case.get("named") or case.get("verdict") or "?", *(f"or {tie}" for tie in case.get("ties", []))])
            word = case.get("oracle", "-") + (f" {case['truth_ahead']:+.1f}" if case.get("truth_ahead") is not None else "")
            also = f" and {case['also']}" if case.get("also") else ""
            yield f"{run.get('name', '')} {name}: {case['label']}{also}, {case['family']}, {case['know']}, {case['excite']}: {got}; oracle: {word}"


def show(runs):
    """All tables of these runs ({name, cases})."""
    cases = [case for run in runs for case in run["cases"].values()]
    parts = [main_table(cases)] + [group_table(cases, key) for key in ROWS if len(by(cases, key)) > 1] + [oracle_table(cases)]
    for part in parts:
        print("\n".join(part))
    print()
    for line in misses(runs):
        print(line)


if __name__ == "__main__":
    loaded = []
    for path in sys.argv[1:]:
        with open(path) as file:
            loaded.append(dict(json.load(file), name=path.rsplit("/", 1)[-1].removesuffix(".json")))
    show(loaded)
