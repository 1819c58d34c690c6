#!/usr/bin/env python3
"""Cuts days out of the LBNL fault detection data (Granderson et al., Scientific Data 7:65, 2020), as in `ahu/` and `flexlab/`.

usage: air_handlers.py MZVAV-2-1.csv OUT_FOLDER          the days in ahu/ (experiments at the Energy Resource Station)
       air_handlers.py SZVAV.csv OUT_FOLDER              the days in flexlab/ (experiments at FLEXLAB)

Temperatures become degC; t counts from midnight, in seconds; valves, dampers and fans stay 0..1.
"""
import csv
import os
import sys
from datetime import datetime

import numpy as np

from columns import write

DAYS = {
    "MZVAV-2-1": {"2007-08-29": "ers_2007-08-29_leak1p0gpm", "2008-08-19": "ers_2008-08-19_nofault", "2008-08-25": "ers_2008-08-25_nofault",
                  "2009-05-03": "ers_2009-05-03_nofault", "2009-05-04": "ers_2009-05-04_nofault"},
    "SZVAV": {"2017-09-12": "flexlab_szvav_2017-09-12_hcv_leak40", "2017-09-14": "flexlab_szvav_2017-09-14_hcv_stuck100",
              "2017-09-20": "flexlab_szvav_2017-09-20_nofault", "2017-09-21": "flexlab_szvav_2017-09-21_nofault"},
}
# Our name, the original's; those in degrees Fahrenheit come first.
WARM = {"t_mixed": "AHU: Mixed Air Temperature", "t_outdoor": "AHU: Outdoor Air Temperature", "t_return": "AHU: Return Air Temperature", "y": "AHU: Supply Air Temperature"}
REST = {"u": "AHU: Cooling Coil Valve Control Signal", "u_heat": "AHU: Heating Coil Valve Control Signal", "oa_damper": "AHU: Outdoor Air Damper Control Signal",
        "fan_speed": "AHU: Supply Air Fan Speed Control Signal", "occupied": "Occupancy Mode Indicator", "fault": "Fault Detection Ground Truth"}
OWN = {
    "MZVAV-2-1": ({"r": "AHU: Supply Air Temperature Set Point"},
                  {"fan_on": "AHU: Supply Air Fan Status", "sp_press": "AHU: Supply Air Duct Static Pressure Set Point", "press": "AHU: Supply Air Duct Static Pressure"},
                  ["t", "r", "y", "u", "u_heat", "t_mixed", "t_outdoor", "t_return", "oa_damper", "fan_on", "fan_speed", "sp_press", "press", "occupied", "fault"]),
    "SZVAV": ({"r": "AHU: Supply Air Temperature Cooling Set Point", "r_cool": "AHU: Supply Air Temperature Cooling Set Point",
               "r_heat": "AHU: Supply Air Temperature Heating Set Point"}, {},
              ["t", "r", "r_cool", "r_heat", "y", "u", "u_heat", "t_mixed", "t_outdoor", "t_return", "oa_damper", "fan_speed", "occupied", "fault"]),
}


def when(text):
    for form in ("%m/%d/%Y %H:%M", "%m/%d/%y %H:%M", "%Y-%m-%d %H:%M:%S", "%m/%d/%Y %H:%M:%S"):
        try:
            return datetime.strptime(text.strip(), form)
        except ValueError:
            continue
    raise SystemExit(f"air_handlers.py: '{text}' is no date; like 8/29/2007 0:00")


def number(text):
    try:
        return float(text)
    except ValueError:
        return np.nan


def main():
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    system = os.path.splitext(os.path.basename(sys.argv[1]))[0]
    if system not in DAYS:
        raise SystemExit(f"air_handlers.py: {system} is not known; {', '.join(DAYS)}")
    warm, rest = {**WARM, **OWN[system][0]}, {**REST, **OWN[system][1]}
    found = {day: [] for day in DAYS[system]}
    with open(sys.argv[1], newline="", encoding="utf-8-sig") as file:
        for row in csv.DictReader(file):
            row = {key.strip(): value for key, value in row.items() if key}
            at = when(row["Datetime"])
            if str(at.date()) in found:
                found[str(at.date())].append((at, row))
    for day, rows in found.items():
        if not rows:
            raise SystemExit(f"air_handlers.py: no row of {day} in {sys.argv[1]}")
        midnight = datetime.fromisoformat(day)
        columns = {"t": [(at - midnight).total_seconds() for at, _ in rows]}
        columns |= {name: [(number(row[own]) - 32) / 1.8 for _, row in rows] for name, own in warm.items()}
        columns |= {name: [number(row[own]) for _, row in rows] for name, own in rest.items()}
        write(os.path.join(sys.argv[2], f"{DAYS[system][day]}.csv"), **{name: columns[name] for name in OWN[system][2]})


if __name__ == "__main__":
    main()
