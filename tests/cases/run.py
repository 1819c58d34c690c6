"""Makes fresh cases, runs `drift diagnose` on them, scores and prints the tables; see `run`."""
import argparse
import json
import os
import shlex
import tempfile

import effects
import make
import score
import table
from motions import MOTIONS


def words(text):
    chosen = text.split(",")
    for word in chosen:
        if word not in make.KNOW:
            raise argparse.ArgumentTypeError(f"no '{word}'; {', '.join(make.KNOW)}")
    return chosen


def main():
    parser = argparse.ArgumentParser(prog="tests/cases/run")
    parser.add_argument("seeds", nargs="+", type=int, metavar="SEED")
    parser.add_argument("--tool", required=True, help="the command line of drift")
    parser.add_argument("--count", type=int, default=100, help="cases of a seed (default 100)")
    parser.add_argument("--know", type=words, help="what the loop files say, some of: " + ",".join(make.KNOW))
    parser.add_argument("--excite", choices=MOTIONS, help="one motion for all")
    parser.add_argument("--kind", choices=effects.EFFECTS, metavar="KIND", help="one effect for all that have any")
    parser.add_argument("--clean", action="store_true", help="no effect in any")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--keep", metavar="DIR", help="makes the cases here and leaves them, with scores.json")
    parser.add_argument("--make-only", action="store_true", help="with --keep: runs nothing")
    asked = parser.parse_args()
    tool = shlex.split(asked.tool)
    with tempfile.TemporaryDirectory(prefix="drift-cases-") as scratch:
        runs = []
        for seed in asked.seeds:
            folder = os.path.join(asked.keep or scratch, str(seed))
            labels = make.make_all(folder, seed, asked.count, asked.know, asked.excite, asked.clean, asked.kind)
            if not asked.make_only:
                runs.append(dict(name=str(seed), cases=score.score_all(tool, folder, labels, asked.jobs)))
                with open(os.path.join(folder, "scores.json"), "w") as file:
                    json.dump(runs[-1], file, indent=1)
        if runs:
            table.show(runs)


if __name__ == "__main__":
    main()
