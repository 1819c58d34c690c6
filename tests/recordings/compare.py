#!/usr/bin/env python3
"""Says how far two recordings are apart, column by column. usage: compare.py NEW.csv OLD.csv"""
import sys

import numpy as np


def read(path):
    table = np.genfromtxt(path, delimiter=",", names=True)
    return {name: table[name] for name in table.dtype.names}


def main():
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    new, old = map(read, sys.argv[1:])
    failed = False
    for name, was in old.items():
        if name not in new:
            print(f"{name}: missing")
            failed = True
            continue
        if len(new[name]) != len(was):
            print(f"{name}: {len(new[name])} rows, not {len(was)}")
            failed = True
            continue
        span = np.nanmax(was) - np.nanmin(was) if np.isfinite(was).any() else 0.0
        unlike = np.isnan(new[name]) != np.isnan(was)
        off = np.nanmax(np.abs(new[name] - was)) if np.isfinite(new[name] - was).any() else 0.0
        bad = unlike.any() or off > 1e-5 * max(span, 1e-300) + 1e-9
        failed |= bool(bad)
        print(f"{name}: off by {off:.2g}, span {span:.4g}{', other gaps' if unlike.any() else ''}{'   DIFFERENT' if bad else ''}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
