#!/usr/bin/env python3
"""Makes the recordings in `emps/` from DATA_EMPS.mat and DATA_EMPS_PULSES.mat (the zip EMPS of nonlinearbenchmark.org).

usage: emps.py FOLDER_OF_THE_MAT_FILES OUT_FOLDER. Needs scipy.

qg is the reference, qm the position, vir the voltage at the motor, pulses_N the pulse that was added; the law's own output is computed
from the published law. Where a file names its pulse otherwise, the one further column of its length is taken.
"""
import os
import sys

import numpy as np
from scipy.io import loadmat

from columns import write

KP, KV, SAMPLE_TIME_S = 160.18, 243.45, 1e-3  # EMPS_Description.pdf: 1/s, V s/m
KNOWN = {"t", "qm", "qg", "vir"}


def law(r, y):
    """u = kv (kp (r - y) - v), v differenced over two samples; before the recording the axis rests."""
    before = np.concatenate([[y[0], y[0]], y[:-2]])
    return KV * (KP * (r - y) - (y - before) / (2 * SAMPLE_TIME_S))


def pulse(file, count):
    named = [name for name in file if "puls" in name.lower() and np.size(file[name]) == count]
    other = [name for name in file if not name.startswith("__") and name not in KNOWN and np.size(file[name]) == count]
    chosen = named or other
    if len(chosen) != 1:
        raise SystemExit(f"emps.py: no single column of pulses; there are {', '.join(other) or 'none'}")
    return np.ravel(file[chosen[0]])


def main():
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    source, out = sys.argv[1:]
    for name, kept in [("DATA_EMPS.mat", "emps_train"), ("DATA_EMPS_PULSES.mat", "emps_pulses")]:
        file = loadmat(os.path.join(source, name))
        t, r, y, u = (np.ravel(file[key]) for key in ("t", "qg", "qm", "vir"))
        added = pulse(file, len(t)) if "PULSES" in name else np.zeros(len(t))
        own = law(r, y)
        write(os.path.join(out, f"{kept}.csv"), t=t - t[0], r=r, y=y, u=u, u_ctrl=own, pulse=added)
        if "PULSES" in name:
            write(os.path.join(out, f"{kept}_ctrl.csv"), t=t - t[0], r=r, y=y, u=own, pulse=added)


if __name__ == "__main__":
    main()
