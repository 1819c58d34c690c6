#!/usr/bin/env python3
"""Asks for each wrong or missed case of a scored folder whether the truth would have been likelier (tests/cases/oracle.py), and
writes the answers into the scores. usage: add_oracle.py CASES_DIR SCORES.json --tool DRIFT [--jobs 2]"""
import argparse
import json
import os
import shlex
import sys
from concurrent.futures import ThreadPoolExecutor

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../tests/cases"))
from oracle import missed, oracle  # noqa: E402


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("cases")
    parser.add_argument("scores")
    parser.add_argument("--tool", required=True)
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    with open(asked.scores) as file:
        scores = json.load(file)
    names = [name for name, case in scores["cases"].items() if missed(case)]
    with ThreadPoolExecutor(asked.jobs) as workers:
        answers = workers.map(lambda name: oracle(shlex.split(asked.tool), os.path.join(asked.cases, name)), names)
        for name, (word, ahead) in zip(names, answers):
            scores["cases"][name].update(oracle=word, truth_ahead=ahead)
    with open(asked.scores, "w") as file:
        json.dump(scores, file, indent=1)


main()
