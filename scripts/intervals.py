"""Conformal intervals: mean -+ quantile * sigma, the quantile of each output times a factor by the predicted bending length."""

import numpy as np

LEVEL = 0.9
# Share of unseen drapes on finer cells than the training's that each output is to hold at least.
FINER_LEVEL = 0.85
QUARTERS = 4
# Rounds in which the factors of the quarters, which run into each other, are found; they change by less than 1e-3 in the last.
ROUNDS = 30


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
