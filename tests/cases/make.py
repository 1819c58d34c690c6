"""Makes one case: a folder with loop.toml, truth.toml, train.csv, holdout.csv (healthy.csv), and its label.

The label has the form of the sibling generator's (wide.py), so that either scorer reads it:
  kind, also, place, family, know, excite, params, onset_s; silent: the effect moves nothing; there: what the noise of the process or
  the sensor's own lattice truly is, so that naming it is right. More here: terms, noise, process, colour, lattice.
"""
import json
import os
from dataclasses import dataclass

import numpy as np

import effects
import loop_file
import noises
from families import FAMILIES
from kinds import NOT_SCORED, place
from motions import MOTIONS, motion
from record import record

KNOW = ["model", "rough", "law", "plant", "healthy", "nothing"]
ATTEMPTS = 12
SILENT_PCT = 99.9  # u without the effect fits u with it as well as this


@dataclass
class Small:
    """How the few cases that are committed differ: short, sampled more slowly, under a noise that is given, in few digits."""

    samples: int
    slower: int  # times the family's sample time
    process: str
    process_part: float  # of the usual drive
    digits: float = 50  # steps of the last digit in the noise of y, in what u does from sample to sample
    reference_steps: float = 2000  # steps of the reference's last digit in its span


def fit_pct(of, by):
    return 100 * (1 - np.linalg.norm(of - by) / max(np.linalg.norm(of - of.mean()), 1e-300))


def off(rng, plant, fixed, part):
    """The plant as a loop file states it: each number off by up to a part of it."""

    def factor():
        return float(np.exp(rng.uniform(np.log1p(-part), np.log1p(part))))

    stated = dict(plant)
    if plant["kind"] == "transfer-function":
        gain = factor()
        stated["num"] = [value * gain * (factor() if i == 0 and len(plant["num"]) > 1 else 1) for i, value in enumerate(plant["num"])]
        stated["den"] = [value * factor() if i < len(plant["den"]) - 1 and len(plant["den"]) > 2 else value for i, value in enumerate(plant["den"])]
    elif plant["kind"] == "state-space":
        damping, rate, entry = factor(), factor(), factor()
        (a, b), (c, d) = plant["a"]
        stated["a"] = [[a * damping, b * rate], [c * rate, d * damping]]
        stated["b"] = [[value * entry for value in row] for row in plant["b"]]
    else:
        for key, value in plant.items():
            if isinstance(value, float) and key not in fixed:
                stated[key] = value * factor()
    return stated


def sound(y, u, without, usual):
    """Whether the loop still stands: it neither runs away nor rings at its limits."""
    return np.isfinite(y).all() and np.isfinite(u).all() and np.ptp(u) < 8 * max(np.ptp(without), np.ptp(usual))


def write_csv(path, family, r, y, u, small=None):
    if small:  # few digits, and no time: the loop file has the sample time
        y = rounded(y, family.noise_sd / small.digits)
        u = rounded(u, np.std(np.diff(u)) / small.digits)
        np.savetxt(path, np.column_stack([r, y, u]), delimiter=",", header="r,y,u", comments="", fmt="%.9g")
        return
    t = np.arange(len(r)) * family.sample_time
    np.savetxt(path, np.column_stack([t, r, y, u]), delimiter=",", header="t,r,y,u", comments="", fmt=["%.7g", "%.7g", "%.9g", "%.8g"])


def rounded(values, step):
    """To whole multiples of the power of ten at or below the step."""
    return np.round(values, -int(np.floor(np.log10(step))))


def drawn_noise(rng, family, excite):
    """(process, its part of the usual drive, colour and lattice of the sensor's noise)."""
    process = str(rng.choice(noises.PROCESS if excite != "rest" else noises.PROCESS[1:]))
    part = float(rng.choice([0.03, 0.1]) if excite == "rest" else rng.choice([0.02, 0.05, 0.1]))
    colour = float(rng.choice([0, 0, 0.5, 0.9]))
    lattice = float(family.noise_sd * rng.choice([0, 0, 0, 1.0]))
    return process, part if process != "none" else 0.0, colour, lattice


def make(out, name, key, kind, family_name, know, excite, also=None, small=None):
    """Writes the case and gives its label; None where no draw gives a loop that stands. `key` seeds the draws."""
    rng = np.random.default_rng(key)
    family = FAMILIES[family_name](rng)
    if small:
        family.samples, family.sample_time, family.steps = small.samples, family.sample_time * small.slower, family.steps * small.slower
    usual = record(rng, family, motion(rng, "usual", family))
    scales = effects.Scales(family, *usual)
    process, size, colour, lattice = (small.process, small.process_part, 0.0, 0.0) if small else drawn_noise(rng, family, excite)
    noisy = dict(process=process, process_sd=size * scales.drive, colour=colour, lattice=lattice)
    references = [motion(rng, excite, family) for _ in range(3)]
    if small:
        references = [rounded(r, family.span / small.reference_steps) for r in references]
    seeds = [int(s) for s in rng.integers(2**31, size=3)]

    def recorded(index, terms):
        return record(np.random.default_rng(seeds[index]), family, references[index], terms, **noisy)

    without = recorded(0, ())
    if not sound(*without, without[1], usual[1]):
        return None
    for _ in range(ATTEMPTS):
        terms = [effects.draw(rng, k, scales, family) for k in (kind, also) if k and k != "none"]
        y, u = recorded(0, terms)
        if sound(y, u, without[1], usual[1]):
            break
    else:
        return None
    law, plant = dict(family.law), off(rng, family.plant, family.fixed, 0.35 if know == "rough" else 0.08)
    if know in ("law", "healthy", "nothing"):
        plant = dict(kind="identify")
    if know in ("plant", "healthy", "nothing"):
        law = dict(kind="recorded")
    folder = os.path.join(out, name)
    os.makedirs(folder, exist_ok=True)
    loop_file.write(os.path.join(folder, "loop.toml"), family.sample_time, family.units, law, plant)
    loop_file.write(os.path.join(folder, "truth.toml"), family.sample_time, family.units, law, family.plant, family.noise_sd, terms)
    write_csv(os.path.join(folder, "train.csv"), family, references[0], y, u, small)
    held_out = recorded(1, terms)
    write_csv(os.path.join(folder, "holdout.csv"), family, references[1], *held_out, small)
    if know == "healthy":
        write_csv(os.path.join(folder, "healthy.csv"), family, references[2], *recorded(2, ()))
    # The hold-out as the truth simulates it: the same, all noise left out.
    quiet = record(np.random.default_rng(seeds[1]), family, references[1], terms, noise_sd=0.0)
    first = terms[0] if terms else dict(params={}, onset_s=0.0)
    there = [*noises.TRULY.get(process, []), *(["quantization"] if lattice else [])]
    return dict(
        kind=kind, also=also, place=place(kind), family=family_name, know=know, excite=excite, there=there,
        silent=bool(kind != "none" and fit_pct(u, without[1]) > SILENT_PCT), noise=process, process=size, colour=colour, lattice=lattice,
        params={k: v for k, v in first["params"].items() if k not in NOT_SCORED}, onset_s=first["onset_s"], terms=terms,
        y_fit_without_pct=fit_pct(y, without[0]), u_fit_without_pct=fit_pct(u, without[1]),
        holdout_truth_u_pct=fit_pct(held_out[1], quiet[1]), holdout_truth_y_pct=fit_pct(held_out[0], quiet[0]),
    )


def choices(seed, count, know=None, excite=None, clean=False, only=None):
    """What each of the cases of a seed is: (kind, family, know, excite, second kind). Every fifth has no effect; `only` names the kind of all others."""
    rng = np.random.default_rng([seed, 4711])
    for i in range(count):
        words = know[i % len(know)] if know else KNOW[i % len(KNOW)]
        blind = words in ("plant", "healthy", "nothing")  # the law is unknown, so that nothing can be wrong with it
        kinds = [k for k in effects.EFFECTS if not (blind and place(k) == "controller")]
        kind = "none" if clean or i % 5 == 4 or (only and only not in kinds) else only or str(rng.choice(kinds))
        family = str(rng.choice(effects.EFFECTS[kind][0] if kind != "none" else effects.ALL))
        moves = excite or str(rng.choice(["usual", *MOTIONS]))
        also = effects.SECOND.get(kind)
        also = also if also and rng.random() < 0.3 and family in effects.EFFECTS[also][0] else None
        yield kind, family, words, moves, also


def make_all(out, seed, count, know=None, excite=None, clean=False, only=None):
    """Makes the cases of a seed in `out` with their labels.json; gives the labels."""
    os.makedirs(out, exist_ok=True)
    labels = {}
    for i, (kind, family, words, moves, also) in enumerate(choices(seed, count, know, excite, clean, only)):
        label = make(out, f"case{i:04d}", [seed, i, 815], kind, family, words, moves, also)
        if label:
            labels[f"case{i:04d}"] = label
    with open(os.path.join(out, "labels.json"), "w") as file:
        json.dump(labels, file, indent=1)
    return labels
