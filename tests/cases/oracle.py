"""Why a case was missed: is the truth likelier than what was found?

`drift likelihood` gives the likelihood of a loop file on the recordings, its numbers refitted from where they stand (in nats).
  search       the truth is likelier than what was found by more than SEARCH: the search stopped short
  simulator    what was found is likelier by more than SIMULATOR: project and case maker simulate differently, or the noise is not in the model
  information  else: the recordings hold too little
"""
import json
import os
import subprocess

SEARCH, SIMULATOR = 3.0, 20.0
KEY = "log_likelihood"
LONGEST_S = 600


def likelihood(tool, folder, model):
    """In nats; None where the command is not there or fails."""
    out = os.path.join(folder, f"likelihood-{os.path.splitext(model)[0]}.json")
    command = [*tool, "likelihood", os.path.join(folder, "train.csv"), os.path.join(folder, "holdout.csv"), "--loop", os.path.join(folder, model), "--refit", "--json", out]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST_S)
    except subprocess.TimeoutExpired:
        return None
    if done.returncode or not os.path.exists(out):
        return None
    with open(out) as file:
        return json.load(file).get(KEY)


def oracle(tool, folder):
    """(word, truth less found in nats); ("-", None) where it can't be asked."""
    if not os.path.exists(os.path.join(folder, "truth.toml")):
        return "-", None
    found = "improved.toml" if os.path.exists(os.path.join(folder, "improved.toml")) else "loop.toml"
    truth = likelihood(tool, folder, "truth.toml")
    other = likelihood(tool, folder, found) if truth is not None else None
    if truth is None or other is None:
        return "-", None
    ahead = truth - other
    return ("search" if ahead > SEARCH else "simulator" if ahead < -SIMULATOR else "information"), ahead


def missed(case):
    """Whether a scored case is one to ask about: wrong, not named, or a false alarm."""
    return "error" not in case and (case.get("false_alarm") or (case["label"] != "none" and not case.get("right")))
