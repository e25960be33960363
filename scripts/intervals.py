"""Conformal intervals: mean -+ quantile * sigma, the quantile of each output times a factor by the predicted bending length and one by
the rim's noise."""

import numpy as np

LEVEL = 0.9
# Share of unseen drapes on finer cells than the training's that each output is to hold at least.
FINER_LEVEL = 0.85
QUARTERS = 4
# Rounds in which the factors of the quarters, which run into each other, are found; they change by less than 1e-3 in the last.
ROUNDS = 30
# Likewise of the quantiles and the factors by length and by noise.
ROUNDS_OF_ALL = 8


def rank(count, level=LEVEL):
    """Index, among so many sorted scores, of the one within which `level` of unseen ones lie."""
    return min(int(np.ceil((count + 1) * level)), count) - 1


def raised(scores):
    """Per output: the factor, at least 1, on half widths of which `scores` (rows, 6) are the errors on finer cells, with which FINER_LEVEL
    of them lie within."""
    return np.maximum(1.0, np.sort(scores, axis=0)[rank(len(scores), FINER_LEVEL)])


def conformal_quantiles(error, sigma):
    """Per output: the factor on sigma within which LEVEL of the calibration rows lie."""
    return np.sort(np.abs(error) / sigma, axis=0)[rank(len(error))]


def quarters(length):
    """Which quarter of the lengths each row is in, shortest first."""
    return np.searchsorted(np.quantile(length, np.arange(1, QUARTERS) / QUARTERS), length)


def factor_at(length_mm, nodes_mm, factors):
    """The factor for predicted bending lengths: straight in the logarithm between the nodes, and that of the end beyond."""
    return np.interp(np.log(length_mm), np.log(nodes_mm), factors)


def by_length(scores, length_mm):
    """Nodes [mm], the medians of the quarters of the predicted bending length, and factors, with which LEVEL of the scores (rows, 6)
    of each quarter lie within the factor, the six outputs together (Mondrian conformal, with straight lines for steps)."""
    which = quarters(length_mm)
    nodes = np.array([np.median(length_mm[which == k]) for k in range(QUARTERS)])
    factors = np.ones(QUARTERS)
    for _ in range(ROUNDS):
        left = scores / factor_at(length_mm, nodes, factors)[:, None]
        own = [np.sort(left[which == k], axis=None) for k in range(QUARTERS)]
        factors = factors * np.array([s[rank(len(s))] for s in own]) ** 0.7
    return nodes, factors


def noise_factor_at(noise_mm, nodes_mm, factors):
    """The factor for the noise of rims: straight between the nodes, and on as between the last two beyond."""
    steps = np.diff(factors) / np.diff(nodes_mm)
    beyond = np.maximum(0.0, noise_mm - nodes_mm[-1]) * (steps[-1] if len(steps) else 0.0)
    return np.interp(noise_mm, nodes_mm, factors) + beyond


def by_noise(scores_of_size):
    """The factor for each size of noise with which LEVEL of its scores lie within, least noise first; more noise never has the smaller one."""
    return np.maximum.accumulate([np.sort(scores, axis=None)[rank(scores.size)] for scores in scores_of_size])


def calibrated(scores, length_mm, noise_mm, trained):
    """The `interval` of a model's json. Of rows: errors in sigmas (rows, 6), predicted bending length, the rim's noise, of which there
    are a few sizes, and whether the training has so much: those rows give quantiles and the factor by length, each size its own by noise."""
    sizes_mm = np.unique(noise_mm)
    of_length = of_noise = np.ones(len(scores))
    for _ in range(ROUNDS_OF_ALL):
        quantile = np.sort(scores[trained] / (of_length * of_noise)[trained, None], axis=0)[rank(trained.sum())]
        left = scores / quantile
        nodes, factors = by_length(left[trained] / of_noise[trained, None], length_mm[trained])
        of_length = factor_at(length_mm, nodes, factors)
        left = left / of_length[:, None]
        noise_factors = by_noise([left[noise_mm == size_mm] for size_mm in sizes_mm])
        of_noise = noise_factor_at(noise_mm, sizes_mm, noise_factors)
    return {
        "level": LEVEL,
        "quantile": quantile.tolist(),
        "by_length": {"length_mm": np.round(nodes, 3).tolist(), "factor": np.round(factors, 4).tolist()},
        "by_noise": {"sigma_mm": np.round(sizes_mm, 4).tolist(), "factor": np.round(noise_factors, 4).tolist()},
    }


def half_widths(interval, sigma, length_mm, noise_mm):
    """Of each output (rows, 6), as `Interval::half_in_sigmas` in src/estimate/model.rs has them."""
    half = sigma * np.array(interval["quantile"])
    if nodes := interval.get("by_length"):
        half = half * factor_at(length_mm, nodes["length_mm"], nodes["factor"])[:, None]
    if nodes := interval.get("by_noise"):
        half = half * noise_factor_at(noise_mm, nodes["sigma_mm"], nodes["factor"])[:, None]
    return half
