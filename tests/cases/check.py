"""Compares the case maker's simulator with two others; see `check`.

1. scipy's adaptive integrator (DOP853, tolerance 1e-10) under the recorded u: one smooth loop of each model of a plant.
2. drift-sim itself, noise free: every kind on every family that shows it; u after the start, in percent of its motion.
"""
import os
import subprocess
import sys
import tempfile

import numpy as np
from scipy.integrate import solve_ivp

import effects
import loop_file
import make
from families import FAMILIES
from motions import motion
from record import at_rest, body, record

SAMPLES = 3000
SCIPY_WORST = 1e-7  # of the motion of y
# u by drift-sim fits u made here at least as well, in percent; less where a jump may come a sample earlier (of the stem, of the last
# digit), or where a loop at its hidden limit starts with an integrator that the recording does not show.
DRIFT_WORST_PCT = 99.5
SENSITIVE = {"stiction": 50.0, "quantization": 20.0, "rate_limit": 95.0, "saturation": 90.0}


def drawn(kind, name):
    rng = np.random.default_rng([sum(map(ord, name + (kind or ""))), 3])
    family = FAMILIES[name](rng)
    family.samples = SAMPLES
    scales = effects.Scales(family, *record(rng, family, motion(rng, "usual", family)))
    terms = [effects.draw(rng, kind, scales, family)] if kind else []
    return rng, family, motion(rng, "usual", family), terms


def by_scipy(kind, name):
    """The worst difference of y, of its motion, on a loop that starts at rest."""
    rng, family, reference, terms = drawn(kind, name)
    family.settle = 0.0
    # A delayed input and onsets are the sample's affair: here u is held over each sample as it is.
    family.plant.pop("delay_s", None)
    y, u = record(rng, family, reference, terms, noise_sd=0.0)
    model, number, a, b, c = body(family.plant)
    z, _ = at_rest(model, number, a, b, c, reference[0])
    term = {t["kind"]: t["params"] for t in terms}

    def slope(t, x, held):
        load = 0.0
        if "periodic_load" in term:
            load = term["periodic_load"]["amplitude"] * np.sin(2 * np.pi * term["periodic_load"]["frequency_hz"] * t)
        if family.plant["kind"] == "servo":
            force = number[2] * held - load - number[1] * x[1]
            if "cogging" in term:
                cog = term["cogging"]
                force -= cog["amplitude"] * np.sin(2 * np.pi * x[0] / cog["period"] + cog["phase"])
            return [x[1], force / number[0]]
        if family.plant["kind"] == "tank":
            return [(number[1] * held - load - number[2] * np.sqrt(max(x[0], 0))) / number[0]]
        drive = number[0] * held + number[1] - load
        if "radiation" in term:
            drive -= term["radiation"]["coefficient"] * ((c[0] * x[0] + 273.15) ** 4 - (number[1] + 273.15) ** 4)
        return a[: len(x), : len(x)] @ x + b[: len(x)] * drive

    order = {"servo": 2, "tank": 1, "first-order": 1}.get(family.plant["kind"], 2)
    state, worst = z[:order].copy(), 0.0
    shown = 1 if family.plant.get("output") == "speed" else 0
    for n in range(SAMPLES):
        true = state[shown] if family.plant["kind"] in ("servo", "tank") else c[:order] @ state
        worst = max(worst, abs(true - y[n]))
        t = n * family.sample_time
        state = solve_ivp(slope, (t, t + family.sample_time), state, "DOP853", args=(u[n],), rtol=1e-10, atol=1e-13).y[:, -1]
    return worst / np.ptp(y)


def by_drift(drift, kind, name, folder):
    """How well drift's simulation of the true loop gives u, in percent; the start is left out: each settles from its own."""
    rng, family, reference, terms = drawn(kind, name)
    y, u = record(rng, family, reference, terms, noise_sd=0.0)
    paths = [os.path.join(folder, file) for file in ("recording.csv", "truth.toml", "simulated.csv")]
    make.write_csv(paths[0], family, reference, y, u)
    loop_file.write(paths[1], family.sample_time, family.units, family.law, family.plant, None, terms)
    subprocess.run([drift, "simulate", paths[1], "--reference", paths[0], "-o", paths[2]], check=True, capture_output=True)
    simulated = np.loadtxt(paths[2], delimiter=",", skiprows=1).T
    return make.fit_pct(u[SAMPLES // 4 :], simulated[3][SAMPLES // 4 :])


def main(drift):
    failed = 0
    for kind, name in [(None, "axis"), ("cogging", "motor"), ("periodic_load", "arm"), (None, "tank"), ("radiation", "heater"), ("periodic_load", "pressure"),
                       (None, "two-lags"), (None, "oscillator"), (None, "level")]:
        off = by_scipy(kind, name)
        failed += off > SCIPY_WORST
        print(f"scipy  {name:11s} {kind or '':24s} y off by {off:.1e} of its motion{'' if off <= SCIPY_WORST else '   TOO MUCH'}")
    with tempfile.TemporaryDirectory() as folder:
        for kind, (names, _, _) in effects.EFFECTS.items():
            for name in names:
                fit = by_drift(drift, kind, name, folder)
                enough = fit >= SENSITIVE.get(kind, DRIFT_WORST_PCT)
                failed += not enough
                print(f"drift  {name:11s} {kind:24s} u fits {fit:.4f} %{'' if enough else '   TOO LITTLE'}")
    print(f"{failed} too far apart" if failed else "all agree")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main(sys.argv[1])
