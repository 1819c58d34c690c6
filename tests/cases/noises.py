"""The noise of the process (a load of its own) and of the sensor."""
import numba as nb
import numpy as np

PROCESS = ["none", "ar1", "jumps", "waves", "walk"]
# What such a load truly is, in the project's words: naming it is right.
TRULY = {"jumps": ["load_step", "injected_signal"], "waves": ["periodic_load"]}


@nb.njit(cache=True)
def recursion(new, correlation, first):
    out = np.empty(len(new))
    last = first
    for i in range(len(new)):
        last = correlation * last + new[i]
        out[i] = last
    return out


@nb.njit(cache=True)
def reflected(steps, bound, first):
    out = np.empty(len(steps))
    last = first
    for i in range(len(steps)):
        last += steps[i]
        if last > bound:
            last = 2 * bound - last
        elif last < -bound:
            last = -2 * bound - last
        out[i] = last
    return out


def ar1(rng, count, correlation):
    """Of unit deviation; each sample is `correlation` of the one before and a new part."""
    return recursion(rng.normal(size=count) * np.sqrt(1 - correlation**2), correlation, rng.normal())


def process(rng, word, count, family):
    """(the load at each sample, the load just before the next), of about unit deviation."""
    slow = family.slow * rng.uniform(0.3, 2) / family.sample_time  # in samples
    if word == "none":
        return np.zeros(count), np.zeros(count)
    if word == "jumps":  # compound Poisson: now and then another level, held
        gaps = np.maximum(rng.exponential(6 * slow, size=count // max(int(slow), 1) + 10).astype(int), 1)
        load = np.repeat(rng.normal(size=len(gaps)), gaps)
        load = np.concatenate([load, np.full(max(count - len(load), 0), load[-1])])[:count]
        return load, load
    if word == "waves":
        t = np.arange(count + 1) * family.sample_time
        load = sum(rng.uniform(0.5, 1) * np.sin(2 * np.pi * family.wave_hz * rng.uniform(0.2, 1.5) * t + rng.uniform(0, 2 * np.pi)) for _ in range(rng.integers(1, 4)))
    elif word == "walk":
        load = reflected(rng.normal(size=count + 1) * 1.5 / np.sqrt(10 * slow), 1.7, rng.uniform(-1, 1))
    else:
        load = ar1(rng, count + 1, np.exp(-1 / slow))
    return load[:-1], load[1:]
