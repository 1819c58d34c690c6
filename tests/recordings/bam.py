#!/usr/bin/env python3
"""Makes a recording in the form of `bam_xl330/` from a log of Rhoban's BAM (JSON, one object with a list `entries`).

usage: bam.py LOG.json... OUT_FOLDER

The file's name follows from the log's own kp and trajectory. The duty is the register "present PWM" over its full scale of 885; logs
name it `pwm` or `load`.
"""
import json
import os
import sys

from columns import write

FULL_SCALE = 885.0


def main():
    if len(sys.argv) < 3:
        raise SystemExit(__doc__)
    for path in sys.argv[1:-1]:
        with open(path) as file:
            log = json.load(file)
        entries = log["entries"]
        duty = "pwm" if "pwm" in entries[0] else "load"
        ours = dict(t="timestamp", r="goal_position", y="position", u=duty, speed="speed", vin="input_volts", temp="temp", torque_enable="torque_enable")
        columns = {name: [float(entry[key]) for entry in entries] for name, key in ours.items()}
        columns["u"] = [value / FULL_SCALE for value in columns["u"]]
        write(os.path.join(sys.argv[-1], f"xl330_kp{log['kp']:g}_{log['trajectory']}.csv"), **columns)


if __name__ == "__main__":
    main()
