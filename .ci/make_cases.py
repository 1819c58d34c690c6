#!/usr/bin/env python3
"""Makes cases with the generator of `.ci/cases`, under another noise, on other references, or without any effect.

usage: make_cases.py GENERATOR_DIR OUT --seed N --count N --variant NAME [--clean]

variants:
  as-is      the generator's own references and white noise
  coloured   sensor noise of the same size, each sample 0.9 of the one before and a new part
  steps      references that jump where the generator's move smoothly
  sine       one sine
  one-step   a single step
  small      a tenth of the motion
  rest       a set-point that never moves
"""
import argparse, json, os, sys
import numpy as np

CORRELATION = 0.9


def coloured(rng, samples, deviation):
    new = rng.standard_normal(samples) * np.sqrt(1 - CORRELATION**2)
    out, last = np.empty(samples), rng.standard_normal()
    for i in range(samples):
        last = CORRELATION * last + new[i]
        out[i] = last
    return deviation * out


def references(smooth):
    """Each in the generator's form: (rng, samples, sample time, family, span, centre, segment in seconds)."""

    def steps(rng, samples, tick, family, span, centre, segment):
        out, i = np.empty(samples), 0
        while i < samples:
            length = int(rng.uniform(0.5, 1.5) * segment / tick)
            out[i : i + length] = rng.uniform(centre - span / 2, centre + span / 2)
            i += length
        return out

    def sine(rng, samples, tick, family, span, centre, segment):
        phase = 2 * np.pi * np.arange(samples) * tick / (2.5 * segment) + rng.uniform(0, 2 * np.pi)
        return centre + span / 2 * np.sin(phase)

    def one_step(rng, samples, tick, family, span, centre, segment):
        out = np.full(samples, float(centre))
        out[samples // 3 :] += span / 4
        return out

    def small(rng, samples, tick, family, span, centre, segment):
        return smooth(rng, samples, tick, family, 0.1 * span, centre, segment)

    def rest(rng, samples, tick, family, span, centre, segment):
        return np.full(samples, float(centre))

    return {"steps": steps, "sine": sine, "one-step": one_step, "small": small, "rest": rest}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("generator")
    parser.add_argument("out")
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--variant", default="as-is")
    parser.add_argument("--clean", action="store_true")
    asked = parser.parse_args()
    sys.path.insert(0, asked.generator)
    import generate

    known = references(generate.smooth_reference)
    if asked.variant == "coloured":
        generate.draw_noise = coloured
    elif asked.variant in known:
        generate.smooth_reference = known[asked.variant]
    elif asked.variant != "as-is":
        sys.exit(f"make_cases.py: no variant {asked.variant}; as-is, coloured, {', '.join(known)}")
    families = [generate.SERVO, generate.MOTOR, generate.THERMAL, generate.FLOW, generate.LTI]
    kinds = ["none"] if asked.clean else [kind for kind in generate.KINDS if kind != "none"]
    os.makedirs(asked.out)
    made = {}
    for i in range(asked.count):
        kind = kinds[i % len(kinds)]
        own = families if asked.clean else generate.KINDS[kind]["fams"]
        family = own[(i // len(kinds) + (0 if asked.clean else i)) % len(own)]
        case = generate.make(asked.out, asked.seed, kind, family, i)
        if case:
            made[case[0]] = case[1]
    json.dump(made, open(os.path.join(asked.out, "labels.json"), "w"))


main()
