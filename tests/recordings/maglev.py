#!/usr/bin/env python3
"""Makes the recordings in `maglev/` from the logs of Bocchio01/062020-Lab-Mechatronics (folder `results`).

usage: maglev.py RESULTS_FOLDER OUT_FOLDER. Needs scipy.

Each log is a matrix `logouts`; its rows as the repository's own plots use them: 1 time, 2 reference, 3 measured position, 5 current of
the upper coil, 7 its command, 9 position by the Kalman filter, on which the law acts.
"""
import os
import sys

from scipy.io import loadmat

from columns import write

LOGS = {"multisteps_stairs/PID_anti_windup - KF.mat": "multisteps_stairs_pid_anti_windup", "sinusoidal_slow/PID_gain_scheduling - KF.mat": "sinusoidal_slow_pid_gain_scheduling"}


def main():
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    for source, name in LOGS.items():
        rows = loadmat(os.path.join(sys.argv[1], *source.split("/")))["logouts"]
        t, r, y, i1, u, y_est = (rows[row - 1] for row in (1, 2, 3, 5, 7, 9))
        write(os.path.join(sys.argv[2], f"{name}.csv"), t=t - t[0], r=r, y=y, u=u, y_est=y_est, i1=i1)


if __name__ == "__main__":
    main()
