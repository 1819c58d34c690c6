#!/usr/bin/env python3
"""Makes the recordings in `tclab/` from the pickles of rawlings-group/mlid_2024 (folder `data`).

usage: tclab.py FOLDER_OF_THE_PICKLES OUT_FOLDER

tclab_cl.pickle: set-point changes under several models (sp_*), tclab_cl_dist.pickle: disturbances (dist_*), tclab_prbs.pickle: open loop.
A pickle may run code when it is read: here only arrays are made of it, everything else becomes an empty object.
"""
import os
import pickle
import re
import sys

import numpy as np

from columns import write


class Inert:
    """Stands for anything in the pickle that is not an array."""

    def __init__(self, *_, **__):
        pass

    def __setstate__(self, _):
        pass


class Arrays(pickle.Unpickler):
    def find_class(self, module, name):
        if module.split(".")[0] == "numpy" and name in ("_reconstruct", "ndarray", "dtype", "scalar", "_frombuffer"):
            return super().find_class(module, name)
        if (module, name) == ("_codecs", "encode"):
            return super().find_class(module, name)
        return Inert


def load(path):
    with open(path, "rb") as file:
        return Arrays(file).load()


def slug(label):
    return re.sub(r"[^a-z0-9]+", "_", label.lower()).strip("_")


def closed_loop(run):
    injected = {name: np.zeros_like(run["u"]) if name not in run else run[name] for name in ("din", "dout")}
    (r1, r2), (y1, y2), (u1, u2) = run["ysp"], run["y"], run["u"]
    return dict(t=np.ravel(run["t"]), r=r1, y=y1, u=u1, r2=r2, y2=y2, u2=u2, din1=injected["din"][0], din2=injected["din"][1], dout1=injected["dout"][0],
                dout2=injected["dout"][1])


def main():
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    source, out = sys.argv[1:]
    for file, prefix in [("tclab_cl.pickle", "sp"), ("tclab_cl_dist.pickle", "dist")]:
        for label, run in load(os.path.join(source, file)).items():
            write(os.path.join(out, f"{prefix}_{slug(label)}.csv"), **closed_loop(run))
    run = load(os.path.join(source, "tclab_prbs.pickle"))
    write(os.path.join(out, "openloop_prbs.csv"), t=np.ravel(run["t"]), r=None, y=run["y"][0], u=run["u"][0], y2=run["y"][1], u2=run["u"][1])


if __name__ == "__main__":
    main()
