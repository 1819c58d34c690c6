#!/usr/bin/env python3
"""Completes the scores of the sibling generator's scorer: whether intervals cover the truth in the unit of the answer
(tests/cases/answered_unit.py), and, of each wrong or missed case, whether the truth would have been likelier (tests/cases/oracle.py).
usage: complete_scores.py CASES_DIR SCORES.json --tool DRIFT [--jobs 2]"""
import argparse
import json
import os
import shlex
import sys
from concurrent.futures import ThreadPoolExecutor

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../tests/cases"))
from answered_unit import unknown_drive  # noqa: E402
from oracle import missed, oracle  # noqa: E402
from score import numbers  # noqa: E402


def read(path):
    with open(path) as file:
        return json.load(file)


def in_answered_unit(folder, label):
    """The numbers of the first kind that is named, which is the true one."""
    named = next(p for p in read(os.path.join(folder, "diagnosis.json"))["physics"] if p["kind"] == label["kind"])
    return numbers(named, label, unknown_drive(folder))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("cases")
    parser.add_argument("scores")
    parser.add_argument("--tool", required=True)
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    scores, labels = read(asked.scores), read(os.path.join(asked.cases, "labels.json"))
    for name, case in scores["cases"].items():
        if case.get("exact"):
            case.update(in_answered_unit(os.path.join(asked.cases, name), labels[name]))
    names = [name for name, case in scores["cases"].items() if missed(case)]
    with ThreadPoolExecutor(asked.jobs) as workers:
        answers = workers.map(lambda name: oracle(shlex.split(asked.tool), os.path.join(asked.cases, name)), names)
        for name, (word, ahead) in zip(names, answers):
            scores["cases"][name].update(oracle=word, truth_ahead=ahead)
    with open(asked.scores, "w") as file:
        json.dump(scores, file, indent=1)


main()
