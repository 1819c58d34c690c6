#!/usr/bin/env python3
"""Makes the cases of the sibling generator's wide.py, the same as it makes them itself, and writes beside each what is true.

usage: make_wide.py GENERATOR_DIR OUT --seed N --count N [--know WORD,WORD...] [--excite WORD,WORD...]

truth.toml is the loop file with the true numbers and terms; the law is the one that loop.toml states. wide.py writes none, so that
its calls are watched: the family that it draws, and the effects that it simulates last before it writes the loop file.
"""
import argparse
import copy
import os
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../tests/cases"))
import loop_file  # noqa: E402


def terms_of(g, ef, plant):
    """What the generator's vector of effects says in the project's words."""

    def on(slot):
        return ef[slot] != 0

    out = []

    def add(kind, **params):
        out.append(dict(kind=kind, params=params, onset_s=float(ef[g.ONSET])))

    if on(g.STRI_DF):
        add("stribeck_friction", coulomb=ef[g.COUL], breakaway=ef[g.COUL] + ef[g.STRI_DF], stribeck_speed=ef[g.STRI_VS])
    elif on(g.COUL):
        add("coulomb_friction", level=ef[g.COUL])
    if on(g.COG_A):
        add("cogging", amplitude=ef[g.COG_A], period=2 * np.pi / ef[g.COG_W], phase=ef[g.COG_PH])
    if on(g.USAT):
        add("saturation", lower=plant[7] - ef[g.USAT], upper=plant[7] + ef[g.USAT])
    if on(g.STIC_S):
        add("stiction", stick_band=ef[g.STIC_S], slip_jump=ef[g.STIC_J])
    if on(g.SRAMP):
        add("sensor_drift", rate_per_s=ef[g.SRAMP], noise_growth_per_s=0.0)
    if on(g.PER_A):
        add("periodic_load", amplitude=ef[g.PER_A], frequency_hz=ef[g.PER_W] / (2 * np.pi))
    one = [("stiffness", "stiffness", g.SPRING), ("dead_zone", "half_width", g.DEADZ), ("backlash", "width", g.BACK), ("gain_loss", "loss", g.GAIN),
           ("delay", "delay_s", g.DELAY), ("unmodelled_lag", "time_constant_s", g.LAG), ("sensor_bias", "bias", g.SBIAS), ("quantization", "step", g.QUANT),
           ("load_step", "level", g.LOAD), ("load_ramp", "rate_per_s", g.LRAMP), ("radiation", "coefficient", g.RAD)]
    for kind, name, slot in one:
        if on(slot):
            add(kind, **{name: ef[slot]})
    for kind, slot in [("inertia_change", g.INERTIA), ("viscous_friction", g.VISC), ("sensor_noise", g.NOISE)]:
        if on(slot):
            add(kind, ratio=1 + ef[slot])
    return out


def true_plant(g, family, stated, number):
    """The stated plant with the numbers that were simulated."""
    plant = copy.deepcopy(stated)
    if family in (g.SERVO, g.MOTOR):
        plant.update(inertia=number[0], viscous=number[1], actuator_gain=number[2])
    elif family in (g.THERMAL, g.FLOW):
        plant.update(gain=number[0], time_constant_s=number[1], offset=number[2], delay_s=number[3])
    elif family == g.LEVEL:
        plant.update(num=[number[0]], den=[1.0, 0.0])
    elif family == g.TWO:
        plant.update(num=[number[0]], den=[number[1] * number[4], number[1] + number[4], 1.0], offset=number[2])
    else:
        s, om, la = number[0], number[1], number[2]
        plant.update(a=[[s, om, 0.0], [-om, s, 0.0], [0.0, 0.0, la]])
    return plant


def chosen(words, among):
    """The words that were asked for, of those that the generator knows; all where none was."""
    words = words.split(",") if words else among
    unknown = [word for word in words if word not in among]
    if unknown:
        sys.exit(f"make_wide.py: no '{unknown[0]}'; {', '.join(dict.fromkeys(among))}")
    return words


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("generator")
    parser.add_argument("out")
    parser.add_argument("--seed", required=True)
    parser.add_argument("--count", required=True)
    parser.add_argument("--know")
    parser.add_argument("--excite")
    asked = parser.parse_args()
    sys.path.insert(0, asked.generator)
    import generate as g
    import wide

    seen = {}
    family, simulate, toml = wide.family, g.simulate, g.toml

    def watched_family(rng, fam):
        drawn = family(rng, fam)
        seen.clear()  # of a case that was given up
        seen.update(family=fam, number=drawn[3], stated=copy.deepcopy(drawn[6]["plant"]), noise=drawn[7])
        return drawn

    def watched_simulate(fam, r, ts, sub, pl, ct, ef, *rest, **more):
        if np.any(ef):
            seen["effects"] = ef.copy()
        return simulate(fam, r, ts, sub, pl, ct, ef, *rest, **more)

    def watched_toml(nominal, ts, path):
        toml(nominal, ts, path)
        terms = terms_of(g, seen.pop("effects", np.zeros(g.NP)), seen["number"])
        plant = true_plant(g, seen["family"], seen["stated"], seen["number"])
        loop_file.write(os.path.join(os.path.dirname(path), "truth.toml"), ts, nominal["units"], nominal["controller"], plant, seen["noise"], terms)

    wide.family, g.simulate, g.toml = watched_family, watched_simulate, watched_toml
    wide.KNOW, wide.EXCITE = chosen(asked.know, wide.KNOW), chosen(asked.excite, wide.EXCITE)
    sys.argv = ["wide.py", asked.out, "--seed", asked.seed, "--count", asked.count]
    wide.main()


main()
