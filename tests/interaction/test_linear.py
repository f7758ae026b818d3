"""The interaction that is linear in its weights: its formula in the core, what samples of one robot
change, and what it learns from many robots."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import finlab
from finlab.arrays import Array
from finlab.core import library
from finlab.core.calls import widest_lanes
from finlab.errors import CheckpointError, DataError
from finlab.fit.interaction.own_samples import (
    fit_weights,
    left_out_spread,
    posterior,
    terms_of,
    whitened,
)
from finlab.fit.interaction.samples import Samples, read_samples, read_table, write_samples
from finlab.interaction.interaction import JetGeometry
from finlab.interaction.jets import Jets
from finlab.interaction.linear import (
    FORMULAS,
    USUAL_WEIGHTS,
    WEIGHT_COUNT,
    Linear,
    LinearInteraction,
    Weights,
    read_weights,
    write_weights,
)
from finlab.layout import Layout, layout_to_dict, parse_layout
from finlab.layout.jet_geometry import jet_geometry_of
from finlab.physics import Plant
from finlab.physics.objective import wrench_scale_of
from finlab.research.interaction import judging_plant
from finlab.research.interaction.linear_prior import train_weights
from finlab.research.interaction.random_samples import random_samples
from finlab.research.random_layouts import random_jet_robot
from tests.interaction.second_plant import wrenches
from tests.interaction.test_jets import differs

NO_NOISE = {"pair": 0.0, "hull": 0.0}
SHIPPED = Linear()


def geometry(seed: int, count: int = 5) -> JetGeometry:
    """Of a random robot."""
    return jet_geometry_of(random_jet_robot(np.random.default_rng(seed), "robot", (count, count)))


def random_weights(seed: int, latents: int = 3) -> Weights:
    rng = np.random.default_rng(seed)
    mean = 0.05 * rng.normal(size=WEIGHT_COUNT)
    factor = 0.01 * rng.normal(size=(WEIGHT_COUNT, latents))
    return Weights(mean, factor, {"pair": 0.01, "hull": 0.02}, 1.0)


@pytest.mark.parametrize("seed", range(4))
def test_the_core_adds_up_the_terms(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = LinearInteraction(random_weights(seed), geometry(seed))
    force = 8.0 * rng.normal(size=(4, 5, 3))
    inflow = rng.normal(size=(4, 5, 3))
    for met in (None, inflow):
        expected = model.terms.rows(force, met).by_weight @ model.weights.mean
        # Messages below 2e-12 of their size are left out by the core.
        assert_allclose(model.offset(force, met), expected, atol=1e-9)
    change = model.at_rest(force)
    assert_allclose(np.einsum("kib,ibw->kw", change, model.lever), model.offset(force), atol=1e-9)


def test_usual_weights_are_the_formula_of_jets() -> None:
    rng = np.random.default_rng(0)
    robot = geometry(7)
    usual = Weights(USUAL_WEIGHTS, np.zeros((WEIGHT_COUNT, 0)), NO_NOISE, 1.0)
    model = LinearInteraction(usual, robot)
    force = 8.0 * rng.normal(size=(3, 5, 3))
    inflow = rng.normal(size=(3, 5, 3))
    assert_allclose(model.offset(force), Jets().of(robot).offset(force), atol=1e-10)
    assert_allclose(model.offset(force, inflow), Jets().of(robot).offset(force, inflow), atol=1e-10)


@pytest.mark.parametrize("seed", range(3))
def test_derivatives(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = LinearInteraction(random_weights(seed), geometry(seed))
    force = 8.0 * rng.normal(size=(5, 3))
    assert differs(model, force) < 1e-6
    inflow = rng.normal(size=(5, 3))
    offset, slope = model.effect(force, inflow)
    assert_allclose(offset, model.offset(force, inflow), atol=1e-12)
    step = 1e-6
    for i, c in np.ndindex(5, 3):
        moved = np.zeros((5, 3))
        moved[i, c] = step
        change = model.offset(force + moved, inflow) - model.offset(force - moved, inflow)
        assert_allclose(slope[i, c], change / (2.0 * step), atol=1e-6)


@pytest.mark.parametrize("has_messages", [False, True])
def test_any_number_of_lanes_gives_the_same_bits(has_messages: bool) -> None:
    rng = np.random.default_rng(0)
    robot = geometry(3, count=11)
    model = LinearInteraction(random_weights(0), robot) if has_messages else Jets().of(robot)
    force = 8.0 * rng.normal(size=(2, 11, 3))
    function = getattr(library(), model.CORE_FUNCTION)
    widths = [lanes for lanes in (1, 2, 4, 8) if lanes <= widest_lanes()]
    answers = []
    for lanes in widths:
        constants = model.constants_in_lanes(lanes)
        found = model.call_core(function, constants, force, None, True)
        answers.append(np.concatenate([part.ravel() for part in found]))
    for answer in answers[1:]:
        assert_array_equal(answer, answers[0])


def one_robot(seed: int, count: int) -> Samples:
    rng = np.random.default_rng(seed)
    layout = random_jet_robot(rng, "robot", (4, 4))
    command = Plant(layout).sample(rng, (count,))
    return Samples(layout, command, wrenches(layout, command))


def test_the_posterior_is_that_of_a_gaussian_process() -> None:
    """The mean and the variance at other commands, by the covariance of wrenches alone, where the
    shares of weights and noise are those of the prior."""
    prior = random_weights(1, latents=6)._replace(mean=USUAL_WEIGHTS)
    rng = np.random.default_rng(2)
    own = terms_of(one_robot(3, 8))
    # Samples as the prior has them, of which the likeliest shares are near to 1.
    rows, _, _ = whitened(own, prior)
    by_latent = rows @ prior.factor
    after = posterior(own, prior)
    noise_share = (after.noise["pair"] / prior.noise["pair"]) ** 2
    _, left, _ = whitened(own, prior)
    inverse_after = after.factor.T @ after.factor
    assert inverse_after.shape == (6, 6)
    # alpha, from the variance of a direction that the samples do not reach, is found by search.
    errors = []
    other = rng.normal(size=(5, WEIGHT_COUNT)) @ prior.factor
    for weight_share in np.geomspace(1.0 / 64.0, 64.0, 25):
        total = weight_share * by_latent @ by_latent.T + noise_share * np.eye(len(left))
        gain = weight_share * other @ by_latent.T @ np.linalg.inv(total)
        covariance = weight_share * (other @ other.T - gain @ by_latent @ other.T)
        weights = prior.factor @ (weight_share * by_latent.T @ np.linalg.solve(total, left))
        by_after = np.linalg.lstsq(prior.factor, after.factor, rcond=None)[0]
        errors.append(
            max(
                np.abs(weights + prior.mean - after.mean).max(),
                np.abs(other @ by_after @ by_after.T @ other.T - covariance).max(),
            )
        )
    assert min(errors) < 1e-9


@pytest.mark.parametrize("scale", [0.1, 3.0])
def test_intervals_are_widened_by_samples_left_out(scale: float) -> None:
    """Beside regressions without each of the samples in turn; residuals are `scale` times what the
    model says."""
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(48, 4))
    left = scale * rng.normal(size=48)
    alpha = 0.7
    beta = 1.3
    values, vectors = np.linalg.eigh(rows.T @ rows)
    variance = 1.0 / (1.0 / alpha + values / beta)
    rows = rows @ vectors
    mean = variance * (rows.T @ left) / beta
    ratios = []
    for k in range(8):
        out = slice(6 * k, 6 * k + 6)
        others = np.delete(rows, out, axis=0)
        covariance = np.linalg.inv(np.eye(4) / alpha + others.T @ others / beta)
        by_others = covariance @ others.T @ np.delete(left, out) / beta
        total = beta * np.eye(6) + rows[out] @ covariance @ rows[out].T
        ratios.append(np.abs(left[out] - rows[out] @ by_others) / np.sqrt(np.diag(total)))
    expected = max(1.0, float(np.quantile(np.concatenate(ratios), 0.9)) / 1.645)
    found = left_out_spread(rows, variance / beta, left - rows @ mean, beta)
    assert found == pytest.approx(expected, rel=1e-9)
    assert (found > 1.5) == (scale > 1.0)


def test_a_file_holds_the_weights(tmp_path: Path) -> None:
    weights = random_weights(5)
    write_weights(tmp_path / "w.safetensors", weights)
    read = read_weights(str(tmp_path / "w.safetensors"))
    assert_allclose(read.mean, weights.mean, rtol=1e-6)
    assert_allclose(read.factor, weights.factor, atol=1e-3 * np.abs(weights.factor).max())
    assert read.noise == pytest.approx(weights.noise)


@pytest.mark.parametrize("content", [b"", b"\0" * 100, b'{"a": 1}'])
def test_damaged_files_are_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "damaged.safetensors"
    path.write_bytes(content)
    with pytest.raises(CheckpointError, match="damaged.safetensors"):
        read_weights(str(path))


def test_a_file_of_other_terms_is_refused(tmp_path: Path) -> None:
    other = random_weights(5)._replace(mean=np.zeros(7))
    write_weights(tmp_path / "w.safetensors", other)
    with pytest.raises(CheckpointError, match="mean: expected finite numbers"):
        read_weights(str(tmp_path / "w.safetensors"))


def test_a_layout_names_the_shipped_prior() -> None:
    layout = replace(finlab.load_layout("bluerov2_heavy"), interaction=SHIPPED)
    assert parse_layout(layout_to_dict(layout)) == layout
    allocator = finlab.Allocator(layout)
    one = allocator.allocate([30, 0, 10, 0, 0, 1])
    assert one.err_norm < 1e-6
    assert np.linalg.norm(one.expected_miss) > 0.0
    many = allocator.allocate_batch([[30, 0, 10, 0, 0, 1]] * 3)
    assert_allclose(many.command[1], one.command, atol=1e-9)


def test_a_bundle_takes_the_weights_along(tmp_path: Path) -> None:
    from finlab.deploy.bundle import make_bundle

    write_weights(tmp_path / "w.safetensors", read_weights_of_shipped())
    named = Linear(str(tmp_path / "w.safetensors"))
    allocator = finlab.Allocator(replace(finlab.load_layout("bluerov2_heavy"), interaction=named))
    make_bundle(allocator).write_zip(tmp_path / "robot.zip")
    here = allocator.allocate([30, 0, 10, 0, 0, 1])
    there = finlab.Allocator.from_bundle(tmp_path / "robot.zip").allocate([30, 0, 10, 0, 0, 1])
    assert_allclose(there.command, here.command, atol=1e-12)


def read_weights_of_shipped() -> Weights:
    from finlab.interaction.linear import SHIPPED_PRIOR

    return read_weights(str(SHIPPED_PRIOR))


def forward_errors(
    own: int,
    weights: Weights,
    seeds: range,
    plant_of: Callable[[Layout, Array], Array] = wrenches,
    count: tuple[int, int] = (3, 8),
) -> tuple[Array, Array, Array]:
    """Errors (K, 6) by the laws and by weights after own samples, and their deviations, over the
    wrench scale, of robots of so many actuators that a plant judges, usually the second one."""
    laws = []
    errors = []
    deviations = []
    for seed in seeds:
        rng = np.random.default_rng([71, seed])
        layout = random_jet_robot(rng, "robot", count)
        command = Plant(layout).sample(rng, (20 + own,))
        samples = Samples(layout, command, plant_of(layout, command))
        tested = terms_of(samples.some(slice(0, 20)))
        known = weights
        if own > 0:
            known = fit_weights(samples.some(slice(20, None)), weights).weights
        model = LinearInteraction(known, jet_geometry_of(layout))
        plant = Plant(layout)
        force = np.einsum("kia,iab->kib", plant.force(command[:20]), layout.frames)
        laws.append(tested.missed)
        errors.append(tested.missed - model.offset(force) / wrench_scale_of(layout))
        deviations.append(model.deviation(force) / wrench_scale_of(layout))
    return np.concatenate(laws), np.concatenate(errors), np.concatenate(deviations)


def size(errors: Array) -> float:
    return float(np.sqrt((errors**2).sum(axis=1).mean()))


@cache
def shipped_errors(own: int) -> tuple[Array, Array, Array]:
    return forward_errors(own, read_weights_of_shipped(), range(16))


def test_the_shipped_prior_halves_what_laws_miss_of_another_plant() -> None:
    laws, errors, _ = shipped_errors(0)
    assert size(errors) < 0.5 * size(laws)


def test_own_samples_better_the_shipped_prior() -> None:
    before = size(shipped_errors(0)[1])
    assert size(shipped_errors(20)[1]) < 0.5 * before
    assert size(shipped_errors(100)[1]) < 0.4 * before


@pytest.mark.parametrize("own", [0, 20, 100])
def test_intervals_hold_what_they_promise(own: int) -> None:
    _, errors, deviations = shipped_errors(own)
    inside = (np.abs(errors) < 1.645 * deviations).mean()
    assert 0.8 < inside < 0.99


@pytest.mark.parametrize("count", [(3, 8), (9, 12)])
@pytest.mark.parametrize("own", [0, 20, 100])
def test_intervals_hold_on_a_plant_by_which_nothing_was_chosen(
    own: int, count: tuple[int, int]
) -> None:
    weights = read_weights_of_shipped()
    _, errors, deviations = forward_errors(own, weights, range(8), judging_plant.wrenches, count)
    inside = (np.abs(errors) < 1.645 * deviations).mean()
    assert 0.8 < inside < 0.99


def test_training_from_robots_with_one_plant() -> None:
    weights, _ = train_weights(random_samples(wrenches, 60, 20, 0, 0.02, (3, 8)))
    laws, errors, _ = forward_errors(0, weights, range(100, 110))
    assert size(errors) < 0.3 * size(laws)


def test_training_needs_ten_robots() -> None:
    with pytest.raises(DataError, match="at least 10 robots, got 3"):
        train_weights(random_samples(wrenches, 3, 2, 0, 0.02, (3, 4)))


def test_no_sample_is_refused() -> None:
    with pytest.raises(DataError, match="at least one sample"):
        fit_weights(one_robot(1, 4).some(slice(0, 0)), random_weights(1))


def test_flow_is_learned_from_its_column() -> None:
    """A robot whose propellers lose twice of what their open-water line says."""
    layout = finlab.load_layout("bluerov2_heavy")
    rng = np.random.default_rng(0)
    command = Plant(layout).sample(rng, (40,))
    flow = np.concatenate([rng.normal(size=(40, 3)), np.zeros((40, 3))], axis=1)
    truth = USUAL_WEIGHTS.copy()
    truth[len(FORMULAS)] = 2.0
    model = LinearInteraction(
        Weights(truth, np.zeros((WEIGHT_COUNT, 0)), NO_NOISE, 1.0), jet_geometry_of(layout)
    )
    plant = Plant(layout)
    force = np.einsum("kia,iab->kib", plant.force(command), layout.frames)
    wrench = plant.wrench(command) + model.offset(force, plant.point_velocity(flow))
    direction = np.zeros((WEIGHT_COUNT, 1))
    direction[len(FORMULAS)] = 1.0
    prior = Weights(USUAL_WEIGHTS, direction, {"pair": 1e-3, "hull": 1e-3}, 1.0)
    fit = fit_weights(Samples(layout, command, wrench, flow), prior)
    assert fit.weights.mean[len(FORMULAS)] == pytest.approx(2.0, abs=0.05)
    assert fit.after < 0.1 * fit.before


def test_files_of_samples_hold_the_flow(tmp_path: Path) -> None:
    layout = finlab.load_layout("bluerov2_heavy")
    rng = np.random.default_rng(0)
    command = Plant(layout).sample(rng, (3,))
    flow = rng.normal(size=(3, 6))
    samples = Samples(layout, command, rng.normal(size=(3, 6)), flow)
    write_samples(tmp_path / "data.npz", [samples])
    assert_allclose(read_samples(tmp_path / "data.npz")[0].flow, flow)
    names = [f"{name}.force" for name in layout.names]
    header = ",".join([*names, "Fx", "Fy", "Fz", "Tx", "Ty", "Tz", "vx", "wz"])
    table = np.hstack([command[:, :, 0], samples.wrench, flow[:, [0, 5]]])
    np.savetxt(tmp_path / "t.csv", table, "%.9f", ",", header=header, comments="")
    read = read_table(layout, tmp_path / "t.csv").flow
    assert read is not None
    assert_allclose(read[:, [0, 5]], flow[:, [0, 5]], atol=1e-8)
    assert not read[:, 1:5].any()
