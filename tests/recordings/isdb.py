#!/usr/bin/env python3
"""Makes recordings in the form of `isdb/` from isdb10.mat, the International Stiction Data Base (Jelali and Huang, 2010).

usage: isdb.py isdb10.mat OUT_FOLDER [LOOP...]. Needs scipy. LOOP: chem10, pap02, ...; default: the seven that the tests use.

In the file: cdata.chemicals.loopN and cdata.pulpPapers.loopN with PV, OP, SP (absent or of another length: unknown) and Ts in seconds.
"""
import os
import re
import sys

import numpy as np
from scipy.io import loadmat

from columns import write

GROUPS = {"chem": "chemicals", "pap": "pulpPapers"}
LOOPS = ["chem01", "chem10", "chem13", "chem23", "chem29", "pap02", "pap04"]


def main():
    if len(sys.argv) < 3:
        raise SystemExit(__doc__)
    data = loadmat(sys.argv[1], struct_as_record=False, squeeze_me=True)["cdata"]
    for name in sys.argv[3:] or LOOPS:
        kind, number = re.fullmatch(r"([a-z]+)(\d+)", name).groups()
        loop = getattr(getattr(data, GROUPS[kind]), f"loop{int(number)}")
        y, u = (np.ravel(getattr(loop, key)).astype(float) for key in ("PV", "OP"))
        r = np.ravel(getattr(loop, "SP", [])).astype(float)
        t = np.arange(len(y)) * float(loop.Ts)
        write(os.path.join(sys.argv[2], f"{name}.csv"), t=t, r=r if len(r) == len(y) else None, y=y, u=u)


if __name__ == "__main__":
    main()
