#!/usr/bin/env python3
"""Checks of the training scripts: `python scripts/test_scripts.py`."""

import csv
import os
import pathlib
import subprocess
import sys
import tempfile

import jax
import jax.numpy as jnp
import numpy as np

import cluster_ray
import drape_data
import fit_measured_prior
import intervals
import ring
import silhouettes
import snn
import split_passes
import table3
import train


def flat():
    xz = drape_data.flat_xz_mm()
    return np.stack([xz[:, 0], np.zeros(len(xz)), xz[:, 1]], axis=1)


def test_walk_starts_and_turns_as_boundary_rs_says():
    xz = drape_data.flat_xz_mm()
    for index, expected in [(0, (150, -150)), (1, (150, -145)), (61, (150, 150)), (62, (145, 150)), (243, (150, -150))]:
        assert tuple(xz[index]) == expected, (index, xz[index])


def test_every_symmetry_maps_the_flat_square_to_itself():
    for symmetry in drape_data.symmetries():
        assert np.abs(drape_data.transformed(flat(), symmetry) - flat()).max() == 0.0


def test_symmetries_are_eight_and_a_mark_on_the_cloth_moves_with_the_matrix():
    # The mark's height is 2 x + 5 z of the flat cloth.
    marked = flat()
    marked[:, 1] = 2 * marked[:, 0] + 5 * marked[:, 2]
    seen = set()
    for _, matrix, swapped in (symmetries := drape_data.symmetries()):
        seen.add((tuple(matrix.ravel()), swapped))
        assert swapped == (abs(matrix[0, 2]) == 1.0)
    assert len(seen) == 8 and not any(s[2] for s in symmetries[:4])
    for symmetry in symmetries:
        moved = drape_data.transformed(marked, symmetry)
        back = moved @ symmetry[1]  # to where it was
        assert np.allclose(back[:, 1], 2 * back[:, 0] + 5 * back[:, 2])


def test_shards_have_each_file_once_and_those_that_are_there_are_not_made_again():
    shards = [cluster_ray.files_of(shard, 3, 600) for shard in range(3)]
    assert sorted(sum(shards, [])) == [f"drapes-{k:06}.parquet" for k in range(10)]
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder)
        cluster_ray.keep({name: b"x" for name in [cluster_ray.MANIFEST, *shards[1]]}, out)
        assert cluster_ray.missing(out, 3, 600) == [0, 2]
        cluster_ray.keep({cluster_ray.MANIFEST: b"y"}, out)
        assert (out / cluster_ray.MANIFEST).read_bytes() == b"x"
        assert not list(out.glob("*.collected"))
    assert cluster_ray.option(["--walk", "--count=7"], "--count") == "7"
    assert cluster_ray.option(["--count", "8"], "--count") == "8"
    assert cluster_ray.option(["--counts", "8"], "--count") is None


def test_a_task_of_an_array_does_its_shard_and_takes_a_batch_with_failures_for_done():
    script = pathlib.Path(__file__).parent / "cluster.slurm"
    with tempfile.TemporaryDirectory() as folder:
        program = pathlib.Path(folder) / "program"
        program.write_text('#!/bin/sh\necho "$@"\nexit "$STATUS"\n')
        program.chmod(0o755)

        def task(*words, status, **more):
            more = {"SLURM_ARRAY_TASK_ID": "3", "SLURM_ARRAY_TASK_COUNT": "8", **more}
            known = {"PATH": os.environ["PATH"], "SCAN2PARAMS": str(program), "STATUS": str(status)}
            done = subprocess.run(["bash", script, *words], env=known | more, capture_output=True, text=True)
            return done.returncode, done.stdout.strip()

        said = "batch F --out D --shard 3/8 --threads 1"
        assert task("batch", "F", "--out", "D", status=0) == (0, said)
        assert task("batch", "F", "--out", "D", status=3) == (0, said)
        assert task("batch", "F", "--out", "D", status=1) == (1, said)
        said = "generate --out D --shard 3/64 --threads 2"
        assert task("generate", "--out", "D", status=3, SHARDS="64", SLURM_CPUS_PER_TASK="2") == (3, said)
        assert task("inspect", "F", status=0)[0] == 2
        assert task("batch", "F", status=0, SLURM_ARRAY_TASK_MIN="1")[0] == 2


def test_manifests_of_silhouettes_have_each_specimen_and_face_once_and_one_role():
    title = "file,fabric,density_gsm_from_experiment_script,sample,capture,face,obs"
    rows = [f"f/{s}_{c}.jpg,4,120,{s},{c},{'up' if c < 3 else 'down'}," for s in range(1, 6) for c in range(1, 5)]
    rows += [f"o/{s}_{k}.jpg,4,120,{s},,up,{k}" for s in range(1, 6) for k in range(1, 4)]
    with tempfile.TemporaryDirectory() as folder:
        index = pathlib.Path(folder) / "index.csv"
        index.write_text("\n".join([title, *rows]) + "\n")

        def made(*more):
            out = pathlib.Path(folder) / "out"
            subprocess.run([sys.executable, silhouettes.__file__, index, "--out", out, *more], check=True)
            with open(out / "fabric_4.csv", newline="") as file:
                own = list(csv.DictReader(file))
            with open(out / "all.csv", newline="") as file:
                return own, list(csv.DictReader(file))

        own, every = made()
        assert len(every) == 20 and {row["role"] for row in every} == {"holdout"}
        assert [(row["specimen"], row["face"]) for row in own] == [
            (str(s), face) for s in range(1, 6) for face in ("up", "down")
        ]
        assert {row["specimen"] for row in own if row["role"] == "fit"} == {"1", "2", "3"}
        assert {row["capture"] for row in own} == {"1", "3"} and {row["observation"] for row in own} == {""}
        looks, _ = made("--observations", "1,3")
        assert [row["observation"] for row in looks] == ["1", "3"] * 5


def test_a_group_never_lies_on_both_sides_of_the_split():
    group = np.repeat(np.arange(100), 3)
    parts = drape_data.split_by_group(group, seed=1)
    assert [len(part) for part in parts] == [240, 30, 30]
    assert sorted(np.concatenate(parts)) == list(range(300))
    assert not set(group[parts[0]]) & set(group[parts[2]])


def test_folders_are_joined_and_a_fabric_in_two_of_them_joins_their_groups():
    def drapes(fabric, group, vertices=61):
        count = len(fabric)
        return drape_data.Drapes(
            np.zeros((count, 244, 3), np.float32), np.ones((count, 6)), np.ones(count), np.array(fabric), np.array(group), np.ones(count),
            np.full(count, vertices), {"prior": "p", "seed": 1, "count": count, "simulator": {"vertices": vertices}}, count, {"slow": 1},
        )

    walked, fallen = drapes([4, 9, 7, 2], [0, 0, 1, 1]), drapes([0, 1, 2, 9], [0, 1, 2, 9], vertices=121)
    joined = drape_data.joined(["walked", "fallen"], [walked, fallen])
    assert joined.fabric.tolist() == [4, 9, 7, 2, 0, 1, 2, 9] and joined.left_out == {"slow": 2}
    g = joined.group.tolist()
    assert g[0] == g[1] == g[7] and g[2] == g[3] == g[6]
    assert len({g[0], g[2], g[4], g[5]}) == 4
    assert joined.vertices.tolist() == 4 * [61] + 4 * [121]
    rows = np.array([0, 3, 5, 7])
    assert train.repeated(joined, rows, 3).tolist() == [0, 3, 5, 7, 5, 7, 5, 7] and train.repeated(joined, rows, 1).tolist() == rows.tolist()
    for key, other in (("seed", 2), ("canonical", True)):
        own = drapes([0, 1], [0, 1])
        own.manifest[key] = other
        try:
            drape_data.joined(["walked", "fallen"], [walked, own])
        except SystemExit as error:
            assert f"fallen: {key}" in str(error)
        else:
            raise AssertionError(f"folders that differ in {key} were joined")


def test_noise_has_the_stated_size_and_keeps_doubled_corners_together():
    noise = drape_data.Noise(smooth_mm=1.0, white_mm=0.0, shift_mm=0.0, yaw_deg=0.0, tilt_deg=0.0)
    still = np.repeat(flat()[None].astype(np.float32), 4000, axis=0)
    moved, _ = train.noisy(jax.random.key(0), still, np.ones(4000, np.float32), noise, noise.basis())
    offset = np.asarray(moved) - still
    # A uniform size up to 1 mm has a mean square of 1/3.
    assert abs(np.sqrt(np.mean(offset**2)) - np.sqrt(1 / 3)) < 0.02
    for side in range(4):
        assert np.abs(offset[:, 61 * side + 60] - offset[:, (61 * side + 61) % 244]).max() < 1e-4
    moved, _ = train.noisy(jax.random.key(0), still, np.ones(4000, np.float32), noise, noise.basis(), size_mm=0.75)
    assert abs(np.sqrt(np.mean((np.asarray(moved) - still) ** 2)) - 0.75) < 0.02


def test_no_noise_leaves_rims_and_densities_as_they_are():
    noise, rims = drape_data.Noise.none(), np.repeat(flat()[None].astype(np.float32), 3, axis=0)
    moved, density = train.noisy(jax.random.key(0), rims, np.ones(3, np.float32), noise, noise.basis())
    assert np.array_equal(moved, rims) and np.array_equal(density, np.ones(3))


def test_the_papers_networks_have_the_sizes_that_it_prints():
    def parameters(name):
        widths, outputs, points = table3.streams_of(name)
        inputs = 3 * len(np.arange(244)[points]) + 1
        params = jax.eval_shape(lambda: table3.streams_init(jax.random.key(0), inputs, widths, outputs))
        return sum(leaf.size for leaf in jax.tree.leaves(params))

    for name, printed in (("SNN", 81.58e6), ("SNN/2", 21.92e6), ("SNN/4", 6.24e6), ("SNN/B", 78.58e6)):
        assert abs(parameters(name) / printed - 1) < 0.01, f"{name}: {parameters(name)}"


def test_the_papers_networks_learn_what_a_line_cannot():
    rng = np.random.default_rng(1)
    x = rng.random((640, 3)).astype(np.float32)
    y = np.stack([np.abs(x[:, k % 3] - 0.5) for k in range(6)], axis=1)
    rmse = {}
    for name, answer in (
        ("line", table3.linear(x[:512], y[:512])),
        ("network", table3.trained(x[:512], y[:512], [256, 256], (3, 3), 1)),
    ):
        rmse[name] = float(np.sqrt(((answer(x[512:]) - y[512:]) ** 2).mean()))
    assert rmse["network"] < 0.7 * rmse["line"], rmse


def test_a_power_law_is_found_and_goes_on():
    sizes = np.array([100, 200, 400, 800])
    errors = 0.5 * sizes**-0.3
    errors[0] *= 2  # the last three sizes alone, in whatever order they were trained
    for order in ([0, 1, 2, 3], [3, 0, 1, 2]):
        at, power = table3.extrapolated(sizes[order], errors[order])
        assert abs(power + 0.3) < 1e-9 and abs(at / (0.5 * 90_000**-0.3) - 1) < 1e-9
    assert table3.extrapolated(sizes[:2], errors[:2]) == (None, None)


def exported_like(apply, to_onnx, density_counts):
    """Checks a network's file against the network: its outputs, its novelty, its answers for a heavier cloth."""
    rng = np.random.default_rng(1)
    centre = rng.normal(size=733) * 50
    subspace = np.linalg.qr(rng.normal(size=(732, 16)))[0]
    exported, width = to_onnx(centre, subspace), np.full(6, 5.0)
    network = train.Network(exported, drape_data.symmetries()[:1], asked_density=200.0, ln_width=width)
    boundary, density = rng.normal(size=(5, 244, 3)) * 60, rng.uniform(50, 300, 5)
    x = np.concatenate([boundary.reshape(5, -1), density[:, None]], axis=1)
    mean, log_sigma = apply((x - centre).astype(np.float32))
    raw = network.raw(boundary, density)
    assert np.abs(raw - np.concatenate([mean, log_sigma], axis=1)).max() < 1e-3
    assert np.abs(raw - 0.5).max() > 0.05  # the weights say something
    assert (np.abs(network.raw(boundary, 2 * density) - raw).max() > 1e-3) == density_counts
    offset = boundary.reshape(5, -1) - centre[:-1]
    left = offset - offset @ subspace @ subspace.T
    novelty = np.sqrt((left**2).sum(1) / 244)
    assert np.abs(network.novelty_mm(boundary, density) / novelty - 1).max() < 1e-4
    # a cloth three times as heavy is three times as stiff, and as sure
    (once, sigma), (thrice, same) = network(boundary, density), network(boundary, 3 * density)
    assert np.abs((thrice - once) * width - np.log(3)).max() < 1e-9 and (sigma == same).all()


def as_stored(params):
    return jax.tree.map(lambda w: np.float16(w).astype(np.float32), params)


def test_the_exported_snn_gives_the_numbers_of_the_trained_one():
    params = as_stored(snn.init(jax.random.key(3), (32, 24, 64)))
    scale = np.random.default_rng(2).uniform(0.005, 0.02, 733)
    apply = lambda offset: snn.apply(params, offset * scale)
    exported_like(apply, lambda centre, subspace: snn.to_onnx([params], centre, scale, subspace), density_counts=True)


def ring_params(seed):
    """A small ring network whose last layers say something of the rim."""
    params = ring.init(jax.random.key(seed), (8, 12), 16, (1, 3))
    keys = iter(jax.random.split(jax.random.key(seed + 1), 100))
    return as_stored(jax.tree.map(lambda w: w + 0.1 * jax.random.normal(next(keys), w.shape), params))


def test_the_exported_ring_network_gives_the_numbers_of_the_trained_one():
    params = ring_params(3)
    apply = lambda offset: ring.apply(params, offset[:, :-1])
    exported_like(apply, lambda centre, subspace: ring.to_onnx([params], centre, subspace), density_counts=False)


def test_several_networks_in_one_file_answer_with_the_mixture_of_theirs():
    members = [ring_params(seed) for seed in (3, 8, 21)]

    def apply(offset):
        means, log_sigmas = zip(*(ring.apply(params, offset[:, :-1]) for params in members))
        return np.mean(means, 0), 0.5 * np.log(np.mean(np.exp(2 * np.array(log_sigmas)), 0) + np.var(means, 0))

    exported_like(apply, lambda centre, subspace: ring.to_onnx(members, centre, subspace), density_counts=False)


def test_to_the_ring_network_the_eight_views_are_alike_but_for_their_places_in_the_weave():
    params = ring_params(5)
    rng = np.random.default_rng(7)
    rims = flat() + 20 * rng.normal(size=(3, 244, 3))
    for side in range(4):
        rims[:, 61 * side + 60] = rims[:, (61 * side + 61) % 244]
    said = lambda params, rims: np.concatenate(ring.apply(params, jnp.asarray(rims.reshape(len(rims), -1), jnp.float32)), axis=1)
    # without places, and with the mean alone of what is pooled, a turned rim is the same one
    blind = dict(params, place=[np.zeros_like(params["place"][0])])
    for stream in ring.STREAMS:
        weight, bias = params[f"{stream}_hidden"]
        blind[f"{stream}_hidden"] = [np.where(np.arange(len(weight))[:, None] < 12, weight, 0.0), bias]
    for symmetry in (symmetries := drape_data.symmetries()):
        turned = drape_data.transformed(rims, symmetry)
        same = np.abs(said(blind, turned) - said(blind, rims)).max()
        if symmetry[0][1] == (symmetry[0][0] + 1) % 244:  # a rotation: a mirror reverses the windows
            assert same < 1e-4, same
    assert np.abs(said(params, drape_data.transformed(rims, symmetries[4])) - said(params, rims)).max() > 1e-2


def test_conformal_quantile_covers_at_least_its_level():
    rng = np.random.default_rng(2)
    covered = []
    for _ in range(200):
        error = rng.standard_t(4, size=(400, 1))
        q = intervals.conformal_quantiles(error[:200], np.ones((200, 1)))
        covered.append(np.mean(np.abs(error[200:]) <= q))
    assert 0.895 < np.mean(covered) < 0.92, np.mean(covered)


def test_intervals_by_length_hold_their_level_in_each_quarter():
    # errors that are 2.4 sigmas for soft cloth and 0.8 for stiff, and lengths that are known to within a tenth
    rng = np.random.default_rng(5)

    def drawn(rows):
        length = np.exp(rng.uniform(np.log(2), np.log(30), rows))
        scores = np.abs(rng.normal(size=(rows, 6))) * (2.4 - 1.6 * np.log(length / 2) / np.log(15))[:, None]
        return scores, length * np.exp(0.1 * rng.normal(size=rows))

    nodes, factors = intervals.by_length(*drawn(4000))
    assert (np.diff(nodes) > 0).all() and (np.diff(factors) < 0).all(), (nodes, factors)
    scores, length = drawn(4000)
    held = scores <= intervals.factor_at(length, nodes, factors)[:, None]
    quarter = intervals.quarters(length)
    each = [held[quarter == k].mean() for k in range(4)]
    assert all(0.885 < share < 0.915 for share in each), each
    # one factor for all does not: 0.78 and 0.99 in the ends
    one = np.sort(scores, axis=None)[intervals.rank(scores.size)]
    assert (scores <= one)[quarter == 0].mean() < 0.85 and (scores <= one)[quarter == 3].mean() > 0.95
    # beyond the ends the factor of the end, and halfway in the logarithm the mean of two
    middle = np.sqrt(nodes[0] * nodes[1])
    got = intervals.factor_at(np.array([0.1, middle, 1e3]), nodes, factors)
    assert np.allclose(got, [factors[0], factors[:2].mean(), factors[3]])


def test_intervals_by_length_and_noise_hold_their_level_for_each_size_of_noise():
    rng = np.random.default_rng(6)
    sizes_mm = np.array([0.0, 0.3, 0.6, 1.0, 2.0])

    def drawn(rows):
        length = np.exp(rng.uniform(np.log(2), np.log(30), rows))
        noise = rng.choice(sizes_mm, rows)
        spread = np.array([1, 2, 1, 1, 0.5, 1]) * ((1.6 - 0.8 * np.log(length / 2) / np.log(15)) * np.hypot(1, noise))[:, None]
        return np.abs(rng.normal(size=(rows, 6))) * spread, length, noise

    scores, length, noise = drawn(20000)
    interval = intervals.calibrated(scores, length, noise, noise <= 1.0)
    assert interval["by_noise"]["sigma_mm"] == sizes_mm.tolist()
    growth = np.array(interval["by_noise"]["factor"])
    assert np.abs(growth / growth[0] / np.hypot(1, sizes_mm) - 1).max() < 0.06, growth
    scores, length, noise = drawn(20000)
    held = scores <= intervals.half_widths(interval, np.ones_like(scores), length, noise)
    for size_mm in sizes_mm:
        assert 0.885 < held[noise == size_mm].mean() < 0.915, size_mm
    within = noise <= 1.0
    assert (np.abs(held[within].mean(0) - 0.9) < 0.015).all(), held[within].mean(0)
    quarter = intervals.quarters(length)
    assert all(0.885 < held[within & (quarter == k)].mean() < 0.915 for k in range(4))
    # without the noise's factor a rim without any would have 0.96 of them held, one of 2 mm 0.65
    blind = scores <= intervals.half_widths(interval | {"by_noise": None}, np.ones_like(scores), length, noise)
    assert blind[noise == 0].mean() > 0.93 and blind[noise == 2].mean() < 0.7
    # beyond the last size it goes on, and less noise than the first has the first's
    nodes, factors = interval["by_noise"].values()
    ends = intervals.noise_factor_at(np.array([3.0, 0.0]), nodes, factors)
    assert np.allclose(ends, [2 * factors[4] - factors[3], factors[0]])


def test_more_noise_never_has_the_smaller_factor():
    scores = np.linspace(0, 1, 600).reshape(100, 6)
    assert (np.diff(intervals.by_noise([scores, 0.5 * scores, 2 * scores])) >= 0).all()


def test_intervals_are_widened_for_finer_cells_where_they_do_not_hold_and_never_narrowed():
    rng = np.random.default_rng(4)
    scores = np.abs(rng.normal(size=(4000, 6))) / 1.645 * np.array([1.0, 1.5, 0.5, 1.0, 2.0, 1.0])
    wider = intervals.raised(scores)
    # 85 % of a Gaussian lie within 1.44 sigmas, 90 % within 1.645
    assert np.abs(wider - np.maximum(1.0, np.array([1, 1.5, 0.5, 1, 2, 1]) * 1.4395 / 1.645)).max() < 0.05, wider
    held = (scores <= wider).mean(0)
    assert np.abs(held[[1, 4]] - intervals.FINER_LEVEL).max() < 0.002 and (held >= intervals.FINER_LEVEL).all(), held


def test_coverage_by_quarter_finds_the_soft_quarter_that_is_not_held():
    class Scaling:
        ln_min, ln_max = np.zeros(6), np.full(6, 10.0)

    truth, density = np.random.default_rng(4).uniform(0, 1, (100, 6)), np.full(100, 200.0)
    length = drape_data.bending_length_mm(np.exp(10 * truth), density)
    covered = np.ones((100, 6), bool)
    covered[length < np.quantile(length, 0.25)] = False
    assert train.coverage_by_quarter(covered, truth, density, Scaling) == [0.0, 1.0, 1.0, 1.0]
    # the mean fabric of Table 2: 8.1 mm
    mean = np.array([[131e3, 164e3, 75e3, 1119.74, 1370.87, 1245.30]])
    assert abs(drape_data.bending_length_mm(mean, np.array([214.02]))[0] - 8.11) < 0.01


def test_the_mixture_of_the_measured_prior_finds_two_groups_again():
    rng = np.random.default_rng(1)
    groups = [rng.normal([0.0, 1.0], [0.2, 0.4], (400, 2)), rng.normal([3.0, -1.0], [0.5, 0.3], (400, 2))]
    means, covs, _ = fit_measured_prior.fit_mixture(np.concatenate(groups), 2, rng)
    order = np.argsort(means[:, 0])
    assert np.abs(means[order] - [[0.0, 1.0], [3.0, -1.0]]).max() < 0.1
    assert np.abs(np.sqrt(covs[order].diagonal(axis1=1, axis2=2)) - [[0.2, 0.4], [0.5, 0.3]]).max() < 0.06


def test_passes_share_out_the_points_and_are_moved_as_stiff_bodies():
    points = np.random.default_rng(3).normal(size=(600, 3))
    parts = list(split_passes.passes(points, 3, np.random.default_rng(1)))
    assert [len(part) for part in parts] == [200] * 3
    order = np.random.default_rng(1).permutation(600)
    assert np.abs(parts[0] - points[order[::3]]).max() < 1e-12
    for k in (1, 2):
        own = points[order[k::3]]
        assert 1e-4 < np.abs(parts[k] - own).max() < 0.02 + 0.1 * np.abs(points).max()
        lengths = [np.linalg.norm(of[1:] - of[:-1], axis=1) for of in (own, parts[k])]
        assert np.abs(lengths[0] - lengths[1]).max() < 1e-9


if __name__ == "__main__":
    for name, test in list(globals().items()):
        if name.startswith("test_"):
            test()
            print("ok", name)
