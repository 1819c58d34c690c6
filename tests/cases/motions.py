"""How a reference moves."""
import numpy as np

MOTIONS = ["usual", "steps", "sine", "chirp", "staircase", "one-step", "small", "rest"]


def motion(rng, word, family):
    """The reference of one recording."""
    count, segment = family.samples, family.segment / family.sample_time
    size = rng.uniform(0.1, 0.35) if word == "small" else 1.0
    draw = {"small": moves, "usual": moves, "one-step": one_step}.get(word) or globals()[word]
    shape = draw(rng, count, segment)  # in -0.5 .. 0.5
    if family.drive and word in ("steps", "staircase", "one-step"):  # a drive is not handed raw steps
        width = max(int(0.05 * segment), 1)
        shape = np.convolve(np.r_[np.full(width - 1, shape[0]), shape], np.ones(width) / width, "valid")
    return family.centre + family.span * size * shape


def moves(rng, count, segment):
    """From one random level to the next, along half a cosine, with a rest at each."""
    out, at, level = np.empty(count), 0, rng.uniform(-0.5, 0.5)
    while at < count:
        length = int(rng.uniform(0.5, 1.5) * segment)
        way = max(int(rng.uniform(0.4, 0.9) * length), 2)
        target = rng.uniform(-0.5, 0.5)
        piece = np.full(length, target)
        piece[:way] = level + (target - level) * 0.5 * (1 - np.cos(np.pi * np.arange(way) / way))
        end = min(at + length, count)
        out[at:end] = piece[: end - at]
        at, level = end, target
    return out


def steps(rng, count, segment):
    out, at = np.empty(count), 0
    while at < count:
        end = min(at + int(rng.uniform(0.4, 1.6) * segment), count)
        out[at:end] = rng.uniform(-0.5, 0.5)
        at = end
    return out


def sine(rng, count, segment):
    """Two sines, faded in."""
    t = np.arange(count) / segment
    waves = sum(0.25 * np.sin(2 * np.pi * t * rng.uniform(0.2, 0.8) + rng.uniform(0, 2 * np.pi)) for _ in range(2))
    return (waves - waves[0]) * np.minimum(t / 0.3, 1)


def chirp(rng, count, segment):
    """One sine whose frequency grows eightfold over the recording."""
    part = np.arange(count) / count
    low = rng.uniform(0.1, 0.2)
    cycles = low * count / segment * (8**part - 1) / np.log(8)
    return 0.4 * np.sin(2 * np.pi * cycles)


def staircase(rng, count, segment):
    """Up in equal steps and down again."""
    stairs = int(rng.integers(4, 7))
    place = np.minimum(np.arange(count) * 2 * stairs // count, 2 * stairs - 1)
    up = np.minimum(place, 2 * stairs - 1 - place) / (stairs - 1) - 0.5
    return up if rng.random() < 0.5 else -up


def one_step(rng, count, segment):
    out = np.full(count, -0.25)
    out[int(count * rng.uniform(0.25, 0.4)) :] = 0.25
    return out


def rest(rng, count, segment):
    return np.zeros(count)
