"""Solvers of others beside `allocate`, on the same robot and the same wrenches."""

from collections.abc import Callable, Iterator, Sequence
from importlib.metadata import version
from importlib.util import find_spec
from typing import NamedTuple

import numpy as np

from finlab import load_layout
from finlab.arrays import Array
from finlab.physics import plant_of
from finlab.research.evaluation.document import Row
from tools.speed_groups import peer_solvers
from tools.speed_groups.peer_solvers import Solve, Thrusters
from tools.speed_groups.questions import UNIT_ROBOT, allocator_of, as_questions, rim_targets
from tools.speed_groups.timing import (
    Goal,
    Side,
    Sizes,
    figure_row,
    least_times,
    left_out_row,
    ratio_row,
)

SHARES = (0.3, 0.97)
"""Of reach."""
BEYOND = 1.5
"""Of reach, where the nearest wrench is asked for."""
MET = 1e-6
"""Largest error of an answer that meets its wrench, over the wrench scale."""


class Peer(NamedTuple):
    """A solver of others."""

    words: str
    """What the table says of it, after the name and version of its package."""
    make: Callable[[Thrusters], Solve]
    """Prepares it for a robot."""
    package: str
    """Name of its distribution and of what is imported; empty where it is part of finlab."""
    goal: Goal | None = None
    """Of `allocate` over it."""


PEERS = (
    Peer("`Model`, squared force", peer_solvers.daqp_model, "daqp", Goal(1)),
    Peer("dense, squared force", peer_solvers.piqp_dense, "piqp"),
    Peer("squared force", peer_solvers.osqp_solver, "osqp"),
    Peer("squared force", peer_solvers.clarabel_quadratic, "clarabel"),
    Peer("watts, by power cones", peer_solvers.clarabel_power, "clarabel"),
    Peer("`lsq_linear`, squared force", peer_solvers.scipy_lsq_linear, "scipy"),
    Peer("SLSQP, watts", peer_solvers.scipy_slsqp, "scipy"),
    Peer("PX4's allocation, method `px4`", peer_solvers.px4, ""),
    Peer("`clip(pinv @ w)`, the unit", peer_solvers.pseudo_inverse, ""),
)
"""Solvers of others, those without an optimum last."""


PEERS_BEYOND = (
    Peer("`Model`, least squares", peer_solvers.daqp_least_squares, "daqp"),
    Peer("`lsq_linear`, least squares", peer_solvers.scipy_lsq_linear, "scipy"),
    Peer("PX4's allocation, method `px4`", peer_solvers.px4, ""),
    Peer("`clip(pinv @ w)`, the unit", peer_solvers.pseudo_inverse, ""),
)
"""Solvers of others that answer beyond reach."""


def peer_rows(sizes: Sizes) -> Iterator[Row]:
    """Returns the rows of peers."""
    robot = Thrusters.of(load_layout(UNIT_ROBOT))
    for share in SHARES:
        yield from _rows_at(robot, PEERS, share, sizes)
    yield from _rows_at(robot, PEERS_BEYOND, BEYOND, sizes)


def _rows_at(robot: Thrusters, peers: Sequence[Peer], share: float, sizes: Sizes) -> Iterator[Row]:
    """Rows of peers at a share of reach."""
    allocator = allocator_of(UNIT_ROBOT)
    targets = rim_targets(allocator, share, sizes.questions)
    questions = as_questions(targets)
    sides = {"allocate": Side(allocator.allocate, questions)}
    forces = {"allocate": allocator.allocate_batch(targets).command[:, :, 0]}
    for peer in peers:
        if is_installed(peer.package):
            solve = peer.make(robot)
            sides[_name(peer)] = Side(solve, questions)
            forces[_name(peer)] = np.array([solve(target) for target in targets])
    times = least_times(sides, sizes.repeats)
    watts = _watts(robot, forces["allocate"])
    measured = f"`allocate` at {share:g} of reach"
    error = _errors(robot, targets, forces["allocate"])
    own = figure_row(measured, UNIT_ROBOT, "itself", 1.0)
    yield own | _accuracy(error, watts, watts)
    for peer in peers:
        over = _name(peer)
        if not is_installed(peer.package):
            yield left_out_row(measured, UNIT_ROBOT, over, peer.package)
            continue
        row = ratio_row(measured, UNIT_ROBOT, over, times["allocate"], times[over], peer.goal)
        error = _errors(robot, targets, forces[over])
        yield row | _accuracy(error, _watts(robot, forces[over]), watts)


def is_installed(package: str) -> bool:
    """Returns whether a package can be imported; of finlab itself, "", it can."""
    return not package or find_spec(package) is not None


def _name(peer: Peer) -> str:
    """What the table says of a peer."""
    if not peer.package:
        return peer.words
    if not is_installed(peer.package):
        return f"{peer.package}, {peer.words}"
    return f"{peer.package} {version(peer.package)}, {peer.words}"


def _errors(robot: Thrusters, targets: Array, forces: Array) -> Array:
    """Distance (N,) of what forces (N, n) [N] give from targets (N, 6), over the wrench scale."""
    missing = (forces @ robot.B.T - targets) / robot.scale
    return np.asarray(np.linalg.norm(missing, axis=1))


def _watts(robot: Thrusters, forces: Array) -> Array:
    """Watts (N,) of forces (N, n) [N], by the plant."""
    command = np.zeros((*forces.shape, 3))
    command[..., 0] = forces
    return np.asarray(plant_of(robot.layout).power(command))


def _accuracy(error: Array, watts: Array, least: Array) -> Row:
    """What answers miss, and take where they meet their wrench.

    Args:
        error: of the answers (N,), over the wrench scale.
        watts: of the answers (N,).
        least: watts (N,) of `allocate`.
    """
    meets = error <= MET
    row: Row = {"error": float(error.max()), "missed": float(1.0 - meets.mean())}
    if meets.any():
        row["watts"] = float(watts[meets].sum() / least[meets].sum())
    return row
