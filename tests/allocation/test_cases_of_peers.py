"""Questions on which others judge their allocators, asked of the default method.

Active-set control allocation (Harkegard, 2002; Smeur et al., 2017) answers a weighted
least-squares problem within limits,

    min |W_v (B u - v)|^2 + gamma^2 |W_u (u - u_d)|^2,  low <= u <= high,

and its public test is a thousand random cases of multirotors with their known answers. Their file
of cases is not redistributed, so the cases here are drawn by the same recipe, and
`scipy.optimize.lsq_linear` with `method="bvls"`, an active-set solver, gives the answers. The
other judge is a conic program (Clarabel) of a supply vessel's least power.
"""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

import finlab
from finlab.allocation.policy import Policy
from finlab.arrays import Array
from finlab.assets import shipped_layouts
from finlab.axes import AXES
from finlab.files import parse_yaml
from finlab.layout.load import parse_layout
from tests.oracle_budget import BudgetedPlant
from tests.oracle_plant import OraclePlant

ROBOTS = 20
"""Multirotors, of four to eight rotors."""
CASES_EACH = 50
"""Cases of each: a thousand together."""
WEIGHTS = {"Fz": 1.0, "Tx": np.sqrt(1000.0), "Ty": np.sqrt(1000.0), "Tz": np.sqrt(100.0)}
"""W_v of the axes, as multirotors have it: roll and pitch count most, yaw less, thrust least."""
GAMMA = 1e-4
"""Weight of the commands beside that of the wrench; small, as theirs."""
SUPPLY_WRENCHES = 300
"""Wrenches of the supply vessel."""


def multirotor(rng: np.random.Generator) -> dict:
    """A layout of rotors that push up, at random places, with random drag torques."""
    rotors = []
    for i in range(int(rng.integers(4, 9))):
        x, y = rng.uniform(-0.5, 0.5, 2)
        rotor = {"name": f"r{i}", "type": "thruster", "position_m": [float(x), float(y), 0.0]}
        rotor |= {"axis": [0.0, 0.0, 1.0], "force_n": [0.0, float(rng.uniform(4.0, 10.0))]}
        turn = float(rng.uniform(0.01, 0.05)) * (-1.0) ** i
        model = {"type": "power_law", "forward": float(rng.uniform(5.0, 10.0))}
        rotors.append(rotor | {"torque_per_newton_m": turn, "model": model})
    return {
        "format": "finlab-layout",
        "version": 2,
        "name": "multirotor",
        "axes": list(WEIGHTS),
        "actuators": rotors,
    }


def active_set_answer(B: Array, v: Array, high: Array, W_v: Array, u_d: Array) -> Array:
    """The commands (n,) of the weighted least-squares problem, by an active set."""
    A = np.vstack([W_v[:, None] * B, GAMMA * np.eye(len(high))])
    b = np.concatenate([W_v * v, GAMMA * u_d])
    found = lsq_linear(A, b, (np.zeros(len(high)), high), method="bvls", tol=1e-14)
    return np.asarray(found.x)


def test_a_thousand_active_set_cases() -> None:
    """The weighted error of each case is at most that of its active-set answer."""
    rng = np.random.default_rng(2022)
    axes = [AXES.index(axis) for axis in WEIGHTS]
    W_v = np.array(list(WEIGHTS.values()))
    n_beyond = 0
    worst = -np.inf
    for _ in range(ROBOTS):
        mapping = multirotor(rng)
        layout = parse_layout(mapping)
        plant = OraclePlant(mapping)
        allocator = finlab.Allocator(layout)
        B = plant.effectiveness[axes]
        high = np.array([spec["force_n"][1] for spec in mapping["actuators"]])
        u = rng.uniform(-0.5, 1.5, (CASES_EACH, layout.n)) * high  # half of it beyond the limits
        v = u @ B.T
        targets = np.zeros((CASES_EACH, 6))
        targets[:, axes] = v

        # `closest` weighs errors over the robot's scales.
        result = allocator.allocate_batch(targets[:1])
        weights = np.zeros(6)
        weights[axes] = W_v * result.scale[axes]
        policy = Policy("closest", axis_weights=tuple(weights.tolist()))
        given = allocator.allocate_batch(targets, policy=policy).wrench[:, axes]
        for row in range(CASES_EACH):
            theirs = active_set_answer(B, v[row], high, W_v, 0.5 * high)
            their_error = np.linalg.norm(W_v * (B @ theirs - v[row]))
            error = np.linalg.norm(W_v * (given[row] - v[row]))
            size = np.linalg.norm(W_v * v[row])
            worst = max(worst, (error - their_error) / size)
            n_beyond += bool(their_error > 1e-3 * size)
    assert n_beyond > ROBOTS * CASES_EACH // 4
    assert worst <= 1e-6


def test_a_supply_vessel_takes_the_least_power() -> None:
    """Power and wrench of three hundred wrenches are those of a conic program."""
    pytest.importorskip("clarabel")
    path = shipped_layouts()["supply"]
    mapping = parse_yaml(path.read_text("utf-8"), "supply", ValueError)
    layout = finlab.load_layout("supply")
    plant = OraclePlant(mapping)
    rng = np.random.default_rng(300)
    wrenches = []
    for _ in range(SUPPLY_WRENCHES):
        wrenches.append(plant.wrench(plant.draw(rng, float(rng.uniform(0.1, 0.7)))))
    counts = layout.commanded
    targets = np.where(counts, np.array(wrenches), 0.0)
    result = finlab.Allocator(layout).allocate_batch(targets)
    assert result.err_norm.max() < 1e-6

    none = np.zeros((0, layout.n), bool)
    for target, power in zip(targets, result.power, strict=True):
        cones = BudgetedPlant(plant, none, np.zeros(0))
        for axis in np.flatnonzero(counts):
            value = float(target[axis] / plant.scales[axis])
            cones.program.equal(cones.wrench[axis], value)
        largest = max(cones.total.values())
        x = cones.program.least({k: cost / largest for k, cost in cones.total.items()})
        least = sum(cost * x[k] for k, cost in cones.total.items())
        assert power == pytest.approx(least, rel=1e-5)
