#!/usr/bin/env python3
"""Fit the prior `measured`: bending and density of 618 measured fabrics, stretch and shear of
Table 2 of the paper.

    python scripts/fit_measured_prior.py --fabrics fabrics618_si.csv --out src/fabric/measured.json

The fabrics (Feng et al., SIGGRAPH Asia 2022, repository DrapeTester/ClothDrapeTester; columns
rho_kg_m2, L_warp_Nm, L_weft_Nm, L_bias_Nm) are not part of this repository, the fitted mixture is.
A Gaussian mixture is fitted to the logarithms of their linear bending stiffnesses and density by
expectation maximisation; its components have equal weights, as `Mixture` draws them. AIC falls with
every component up to 16 (the list holds families of nearly alike fabrics, and each gets its own), so it
does not choose: five are taken, as in the paper, and the curve is written beside them. Nobody measured stretch and shear of these fabrics: one truncated
log-normal with Table 2's means and standard deviations (and the correlations of
`fit_prior.py` within the group) stands in, independent of bending and density.
"""

import argparse
import csv
import json

import numpy as np
from scipy.optimize import least_squares

from fit_prior import KEYS, TABLE_2, UNITS, WITHIN

COLUMNS = ["L_weft_Nm", "L_warp_Nm", "L_bias_Nm", "rho_kg_m2"]
# From SI to the paper's units: 1 N m = 1e9 g mm^2 s^-2, 1 kg/m^2 = 1000 g/m^2.
TO_PAPER = np.array([1e9, 1e9, 1e9, 1e3])
MOST_COMPONENTS = 16
COMPONENTS = 5
STARTS = 12
# A component is no narrower than this in any direction of log space: 618 fabrics do not show it.
LEAST_SD = 0.05


def log_densities(x, means, covs):
    """ln N(x | mean_k, cov_k), n x K."""
    out = []
    for mean, cov in zip(means, covs):
        chol = np.linalg.cholesky(cov)
        z = np.linalg.solve(chol, (x - mean).T)
        half_log_det = np.log(np.diag(chol)).sum()
        out.append(-0.5 * (z**2).sum(axis=0) - half_log_det - 0.5 * x.shape[1] * np.log(2 * np.pi))
    return np.stack(out, axis=1)


def log_sum(a):
    top = a.max(axis=1, keepdims=True)
    return (top + np.log(np.exp(a - top).sum(axis=1, keepdims=True)))[:, 0]


def fit_mixture(x, count, rng, rounds=300):
    """Means, covariances and log-likelihood of `count` Gaussians of equal weight."""
    spread = np.cov(x, rowvar=False)
    means = x[rng.choice(len(x), count, replace=False)]
    covs = np.stack([spread / count**0.5] * count)
    before = -np.inf
    for _ in range(rounds):
        logs = log_densities(x, means, covs) - np.log(count)
        total = log_sum(logs)
        share = np.exp(logs - total[:, None])
        weight = share.sum(axis=0)
        means = (share.T @ x) / weight[:, None]
        off = x[None] - means[:, None]
        covs = np.einsum("nk,kni,knj->kij", share, off, off) / weight[:, None, None]
        covs += LEAST_SD**2 * np.eye(x.shape[1])
        if total.sum() - before < 1e-6 * len(x):
            break
        before = total.sum()
    return means, covs, log_sum(log_densities(x, means, covs) - np.log(count)).sum()


def choose_mixture(x, seed):
    """The mixture of COMPONENTS, and the AIC by number of components."""
    rng = np.random.default_rng(seed)
    chosen, curve = None, []
    for count in range(1, MOST_COMPONENTS + 1):
        fits = [fit_mixture(x, count, rng) for _ in range(STARTS)]
        fit = max(fits, key=lambda f: f[2])
        d = x.shape[1]
        unknowns = count * (d + d * (d + 1) / 2)
        curve.append(2 * unknowns - 2 * fit[2])
        if count == COMPONENTS:
            chosen = fit
    return chosen, curve


def stretch_part(draws, seed):
    """Mean and covariance of the logarithms of S^u, S^v, H whose truncated samples have Table 2's moments."""
    z = np.random.default_rng(seed).standard_normal((draws // 2, 3))
    z = np.concatenate([z, -z])
    table = np.array([TABLE_2[k] for k in KEYS[:3]])
    r = np.full((3, 3), WITHIN[0]) + (1 - WITHIN[0]) * np.eye(3)

    def sample(theta):
        sd = np.exp(theta[3:])
        x = np.exp(theta[:3] + z @ np.linalg.cholesky(r * np.outer(sd, sd)).T)
        return x[np.all((x >= table[:, 2]) & (x <= table[:, 3]), axis=1)]

    def residual(theta):
        x = sample(theta)
        return np.log(np.concatenate([x.mean(axis=0) / table[:, 0], x.std(axis=0) / table[:, 1]]))

    width = np.sqrt(np.log1p((table[:, 1] / table[:, 0]) ** 2))
    start = np.concatenate([np.log(table[:, 0]) - 0.5 * width**2, np.log(width)])
    fit = least_squares(residual, start, diff_step=0.01, max_nfev=60)
    sd = np.exp(fit.x[3:])
    return fit.x[:3], r * np.outer(sd, sd), np.abs(np.expm1(fit.fun)).max()


def read_fabrics(path):
    with open(path) as file:
        rows = list(csv.DictReader(file))
    return np.array([[float(row[c]) for c in COLUMNS] for row in rows]) * TO_PAPER


def quantiles(x):
    """5th, 25th, 50th, 75th, 95th percentile of each column."""
    return np.percentile(x, [5, 25, 50, 75, 95], axis=0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--fabrics", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--seed", type=int, default=618)
    parser.add_argument("--draws", type=int, default=100_000)
    args = parser.parse_args()

    fabrics = read_fabrics(args.fabrics)
    (means, covs, likelihood), curve = choose_mixture(np.log(fabrics), args.seed)
    stretch_mean, stretch_cov, moment_error = stretch_part(args.draws, args.seed)
    components = []
    for mean, cov in zip(means, covs):
        whole = np.zeros((7, 7))
        whole[:3, :3], whole[3:, 3:] = stretch_cov, cov
        components.append(
            {
                "mean_ln": np.round(np.concatenate([stretch_mean, mean]), 6).tolist(),
                "cov_ln": np.round(whole, 6).tolist(),
            }
        )
    rng = np.random.default_rng(args.seed)
    draws = [rng.multivariate_normal(m, c, args.draws // len(means)) for m, c in zip(means, covs)]
    mixed = np.exp(np.concatenate(draws))
    correlation = np.corrcoef(np.log(fabrics), rowvar=False)
    prior = {
        "schema": "scan2params/prior/1",
        "name": "measured",
        "provenance": (
            f"Fitted by scripts/fit_measured_prior.py to the linear bending stiffnesses and densities of "
            f"{len(fabrics)} measured fabrics (Feng et al., Learning-based bending stiffness parameter "
            "estimation by a drape tester, SIGGRAPH Asia 2022); stretch and shear were not measured: a "
            "log-normal with the moments of Table 2 of Ju and Choi 2020 stands in, independent of the rest. "
            "Five components of equal weight; AIC does not choose their number (check.aic_by_components)."
        ),
        "keys": KEYS,
        "units": UNITS,
        "min": [TABLE_2[k][2] for k in KEYS[:3]] + np.round(fabrics.min(axis=0), 2).tolist(),
        "max": [TABLE_2[k][3] for k in KEYS[:3]] + np.round(fabrics.max(axis=0), 2).tolist(),
        "components": components,
        "check": {
            "fabrics": len(fabrics),
            "log_likelihood": round(likelihood, 2),
            "aic_by_components": np.round(curve, 1).tolist(),
            "median": np.round(np.median(fabrics, axis=0), 2).tolist(),
            "log_sd": np.round(np.log(fabrics).std(axis=0), 3).tolist(),
            "log_correlation": np.round(correlation, 3).tolist(),
            "mixture_quantiles": np.round(quantiles(mixed), 2).tolist(),
            "fabrics_quantiles": np.round(quantiles(fabrics), 2).tolist(),
            "stretch_moment_error": round(moment_error, 6),
        },
    }
    with open(args.out, "w") as out:
        json.dump(prior, out, indent=1)
        out.write("\n")
    print("AIC by components", np.round(curve, 1), "chosen", len(components))
    print("worst relative error of a moment of stretch or shear", moment_error)


if __name__ == "__main__":
    main()
