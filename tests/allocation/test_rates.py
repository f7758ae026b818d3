"""What may follow a command: said by hand for each number, and asked of commands on both sides."""

import math

import numpy as np
import pytest

from finlab.actuators.thrust_model import PowerLaw
from finlab.allocation.rates import Rates
from finlab.arrays import Array
from finlab.layout import Azimuth, Layout, Thruster, load_layout
from finlab.physics import plant_of
from tests.random_robots import load, random_robot

TURN = 2.0 * math.pi
NAMES = ("penta", "restricted", "catamaran", "azimuths", "mixed")
"""Fins that turn freely, fins in arcs, pods, and random robots."""


def layout_of(name: str) -> Layout:
    """A shipped robot, or a random one of a kind."""
    return load(random_robot(name, 1, 5)) if name in ("azimuths", "mixed") else load_layout(name)


def rates_of(name: str, rng: np.random.Generator) -> Rates:
    """A robot whose steps are about a fifth of the ranges, some without a limit."""
    plant = plant_of(layout_of(name))
    step = rng.uniform(0.05, 0.4, plant.lower.shape) * plant.width
    step[rng.random(step.shape) < 0.2] = np.inf
    return Rates(plant, step)


def change_of(rates: Rates, previous: Array, command: Array) -> Array:
    """Changes (..., n, 3) of commands: of free angles the least over all full turns."""
    turns = TURN * np.arange(-4, 5).reshape(-1, *(1,) * command.ndim)
    least_turned = np.abs(command - previous + turns).min(axis=0)
    return np.where(rates.plant.turns, least_turned, np.abs(command - previous))


def commands_near(rates: Rates, previous: Array, rng: np.random.Generator) -> Array:
    """Commands (200, n, 3) within the limits, most within a few steps of the previous one."""
    width = rates.plant.width
    reach = np.minimum(rates.step, width) * rng.choice([0.7, 1.05, 3.0], (200, *width.shape))
    near = previous + reach * rng.uniform(-1.0, 1.0, (200, *width.shape))
    return rates.plant.feasible(near)


@pytest.mark.parametrize("name", NAMES)
def test_a_command_is_allowed_whose_every_change_is_within_its_step(name: str) -> None:
    rng = np.random.default_rng(1)
    judged = set[bool]()
    for _ in range(20):
        rates = rates_of(name, rng)
        previous = rates.plant.sample(rng, ())
        for command in commands_near(rates, previous, rng)[:40]:
            # One number alone moves: it decides.
            i, k = rng.integers(rates.plant.n), rng.integers(3)
            one_moved = previous.copy()
            one_moved[i, k] = command[i, k]
            fits = bool((change_of(rates, previous, one_moved) <= rates.step).all())
            assert rates.allow(previous, one_moved) == fits
            judged.add(fits)
        lost = previous.copy()
        lost[0] = np.nan
        assert rates.allow(lost, previous) and rates.allow(previous, lost)
    assert judged == {True, False}


@pytest.mark.parametrize("name", NAMES)
def test_the_box_has_the_commands_within_limits_and_steps_and_no_others(name: str) -> None:
    rng = np.random.default_rng(2)
    inside_box = outside_box = 0
    for _ in range(10):
        rates = rates_of(name, rng)
        plant = rates.plant
        previous = plant.sample(rng, ())
        box = rates.box(previous)
        command = commands_near(rates, previous, rng)
        fits = change_of(rates, previous, command) <= rates.step * (1.0 + 1e-9)
        # Free angles of the box are counted from the previous one, full turns beyond the limits.
        turned = command + TURN * np.arange(-2, 3)[:, None, None, None]
        counted = np.where(box.turns, turned, command)
        slack = 1e-9
        within = ((counted >= box.lower - slack) & (counted <= box.upper + slack)).any(axis=0)
        np.testing.assert_array_equal(within, fits)
        # What reaches all around is free, and no other angle is.
        np.testing.assert_array_equal(box.any_angle, plant.turns & (rates.step >= math.pi))
        np.testing.assert_array_equal(box.turns, plant.turns & (rates.step < math.pi))
        inside_box += int(within.sum())
        outside_box += int((~within).sum())
    assert min(inside_box, outside_box) > 100


@pytest.mark.parametrize("name", NAMES)
def test_an_actuator_without_a_known_command_is_held_by_its_limits_alone(name: str) -> None:
    rng = np.random.default_rng(3)
    rates = rates_of(name, rng)
    plant = rates.plant
    previous = plant.sample(rng, ())
    known = rates.box(previous)
    previous[1, rng.integers(3)] = np.nan
    box = rates.box(previous)
    np.testing.assert_array_equal(box.lower[1], plant.lower[1])
    np.testing.assert_array_equal(box.upper[1], plant.upper[1])
    np.testing.assert_array_equal(box.any_angle[1], plant.turns[1])
    assert not box.turns[1].any()
    others = np.arange(plant.n) != 1
    np.testing.assert_array_equal(box.lower[others], known.lower[others])
    np.testing.assert_array_equal(box.upper[others], known.upper[others])


@pytest.mark.parametrize("name", NAMES)
def test_clipping_moves_no_number_farther_than_into_the_box(name: str) -> None:
    """By the shorter way round: no number of the box is nearer than the one that is taken."""
    rng = np.random.default_rng(4)
    for _ in range(10):
        rates = rates_of(name, rng)
        plant = rates.plant
        box = rates.box(plant.sample(rng, ()))
        command = plant.sample(rng, (30,))
        clipped = box.clip(command)
        assert (clipped >= box.lower - 1e-12).all() and (clipped <= box.upper + 1e-12).all()
        share = np.linspace(0.0, 1.0, 41)[:, None, None, None]
        tried = box.lower + share * (box.upper - box.lower)
        apart = np.abs(tried - command)
        apart_turned = np.abs((tried - command + math.pi) % TURN - math.pi)
        least = np.where(box.turns, apart_turned, apart).min(axis=0)
        moved = np.where(
            box.turns, np.abs((clipped - command + math.pi) % TURN - math.pi), clipped - command
        )
        assert (np.abs(moved) <= least + 1e-9).all()
        feasible = box.clip_feasible(command, plant)
        assert (feasible >= plant.lower).all() and (feasible <= plant.upper).all()
        np.testing.assert_allclose((feasible - clipped)[..., ~box.turns], 0.0, atol=1e-12)
        full_turns = (feasible - clipped)[..., box.turns] / TURN
        np.testing.assert_allclose(full_turns, np.round(full_turns), atol=1e-9)


def test_a_pod_and_a_thruster_by_hand() -> None:
    model = PowerLaw(1.0)
    pod = Azimuth("pod", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 40.0), model)
    screw = Thruster("screw", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (-30.0, 30.0), model)
    rates = Rates(
        plant_of(Layout("two", (pod, screw))), np.array([[0.5, 8.0, 0.0], [25.0, 0.0, 0.0]])
    )
    previous = np.array([[3.0, 35.0, 0.0], [-20.0, 0.0, 0.0]])
    box = rates.box(previous)
    np.testing.assert_allclose(box.lower, [[2.5, 27.0, 0.0], [-30.0, 0.0, 0.0]])
    np.testing.assert_allclose(box.upper, [[3.5, 40.0, 0.0], [5.0, 0.0, 0.0]])
    # From 3.0 over the seam to -2.9 are 0.38 rad, to -2.6 are 0.68.
    over = np.array([[-2.9, 35.0, 0.0], [4.0, 0.0, 0.0]])
    assert rates.allow(previous, over)
    assert not rates.allow(previous, over + [[0.3, 0.0, 0.0], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(box.clip(over)[0], [TURN - 2.9, 35.0, 0.0])
    np.testing.assert_allclose(
        box.clip_feasible(over + [[0.3, 0.0, 0.0], [9.0, 0.0, 0.0]], rates.plant),
        [[3.5 - TURN, 35.0, 0.0], [5.0, 0.0, 0.0]],
    )
