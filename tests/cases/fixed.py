"""Makes the small fixed set in `fixed/`: one case of every kind, and some without any effect, that CI runs against all kinds
(tests/tests/kinds_snapshot.rs). usage: fixed.py OUT_DIR; `remake_fixed` calls it.
"""
import gzip
import json
import os
import shutil
import sys
import tempfile

import effects
import make

SEED = 1822
SAMPLES = 2000
# How many times slower than the family's own the samples are taken, so that the few of them hold some moves.
SLOWER = {"axis": 2, "arm": 3, "motor": 2, "heater": 6, "flow": 1, "level": 4, "pressure": 2, "two-lags": 2, "oscillator": 2, "tank": 2}
# Where another family than a kind's first shows it better.
SHOWN_BY = {"backlash": "two-lags", "sensor_lag": "flow", "leak": "two-lags", "saturation": "motor", "injected_signal": "flow", "gain_loss": "pressure", "sensor_noise": "motor",
            "load_step": "arm", "load_ramp": "tank", "periodic_load": "two-lags", "controller_gain": "heater", "delay": "pressure", "dead_zone": "oscillator", "cogging": "motor",
            "quantization": "tank", "sensor_drift": "flow", "nonlinear_gain": "motor", "sensor_hysteresis": "flow", "controller_delay": "two-lags", "rate_limit": "pressure"}
CLEAN = ["axis", "motor", "heater", "level", "oscillator", "tank"]
# With the effect at work u must differ from u without it by at least as much: a case that shows nothing tests nothing.
MOST_FIT_PCT = 97.0
PROCESS, PROCESS_PART = "ar1", 0.01
FILES = ("loop.toml", "truth.toml", "train.csv", "holdout.csv")


def choices():
    """(name, kind, family) of every case."""
    for kind, (families, _, _) in effects.EFFECTS.items():
        yield kind, kind, SHOWN_BY.get(kind, families[0])
    for family in CLEAN:
        yield f"clean_{family}", "none", family


def first_that_shows(scratch, index, name, kind, family):
    small = make.Small(SAMPLES, SLOWER[family], PROCESS, PROCESS_PART)
    for attempt in range(20):
        label = make.make(scratch, name, [SEED, index, attempt], kind, family, "model", "usual", small=small)
        if label and (kind == "none" or label["u_fit_without_pct"] < MOST_FIT_PCT):
            return label
    sys.exit(f"fixed.py: no draw of {kind} shows on {family}")


def pack(source, target):
    with open(source, "rb") as file:
        data = file.read()
    with open(target, "wb") as raw, gzip.GzipFile(filename="", mode="wb", compresslevel=9, fileobj=raw, mtime=0) as packed:
        packed.write(data)


def main(out):
    labels = {}
    with tempfile.TemporaryDirectory() as scratch:
        for index, (name, kind, family) in enumerate(choices()):
            labels[name] = first_that_shows(scratch, index, name, kind, family)
            made, kept = os.path.join(scratch, name), os.path.join(out, name)
            os.makedirs(kept, exist_ok=True)
            for file in FILES:
                if file.endswith(".csv"):
                    pack(os.path.join(made, file), os.path.join(kept, file + ".gz"))
                else:
                    shutil.copyfile(os.path.join(made, file), os.path.join(kept, file))
    with open(os.path.join(out, "labels.json"), "w") as file:
        json.dump(labels, file, indent=1)
        file.write("\n")


if __name__ == "__main__":
    main(sys.argv[1])
