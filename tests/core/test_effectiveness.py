"""What actuators that work span in the axes that count, beside numpy, whatever is lost or free."""

import ctypes

import numpy as np
import pytest

from finlab.arrays import Array
from tests.core.internal_functions import ROBOTS, Robot, Span, at, functions, robot_of


def span_of(robot: Robot, work: ctypes.Array[ctypes.c_char], lost: Array, free: Array) -> Span:
    """What is spanned with some actuators (n,) lost and some axes (6,) free."""
    lost_bytes = lost.astype(np.uint8)
    open_axes = free.astype(np.uint8)
    places = ctypes.c_void_p(lost_bytes.ctypes.data), ctypes.c_void_p(open_axes.ctypes.data)
    assert functions().fl_span_of_question(at(robot.block), work, *places)
    return Span.from_buffer(work)


def columns_of(robot: Robot, lost: Array, free: Array) -> Array:
    """Wrenches (n, 2, 6) [N, N m] per newton of each row, by the laws' own axes."""
    columns = np.zeros((robot.n, 2, 6))
    for i, actuator in enumerate(robot.actuators):
        if lost[i]:
            continue
        for row in range(int(actuator["rows"])):
            axis = (
                actuator["effectiveness_normalized"][1 + row]
                if robot.is_plane(i)
                else actuator["effectiveness_normalized"][row]
            )
            columns[i, row] = (
                (actuator["command_sign"] if actuator["command_kind"] == 0.0 else 1.0)
                * axis
                * robot.head["wrench_scale"]
            )
    return columns * (~free & (robot.head["is_commanded"] != 0.0))


def check_span(robot: Robot, span: Span, lost: Array, free: Array) -> None:
    """The basis is orthonormal and spans all columns, by which the matrices are their
    coordinates."""
    rank = span.rank
    basis = np.array(span.basis)
    np.testing.assert_allclose(basis[:, :rank].T @ basis[:, :rank], np.eye(rank), atol=1e-9)
    assert not basis[:, rank:].any()
    scale = np.array(span.axis_scale)
    columns = columns_of(robot, lost, free)
    sized = columns * robot.actuators["row_force_max"][..., None]
    size = np.sqrt((sized**2).sum(axis=(0, 1)))
    np.testing.assert_allclose(scale, np.where(size > 1e-8 * size.max(), size, 1.0), rtol=1e-9)
    assert rank == np.linalg.matrix_rank((sized / scale).reshape(-1, 6), tol=1e-6)
    matrix = np.array(span.effectiveness_reduced)[: robot.n]
    np.testing.assert_allclose(matrix @ basis.T * scale, columns, atol=1e-7 * np.abs(columns).max())
    assert not matrix[lost].any()

    expected_offset = robot.head["wrench_offset"].copy()
    for i in np.flatnonzero(lost):
        actuator = robot.actuators[i]
        if actuator["zero_lift_drag"] != 0.0:  # a foil, or a steered propeller
            expected_offset -= (
                actuator["pressure_area"]
                * actuator["zero_lift_drag"]
                * actuator["effectiveness_normalized"][1]
                * robot.head["wrench_scale"]
            )
    counts = ~free & (robot.head["is_commanded"] != 0.0)
    np.testing.assert_allclose(span.wrench_offset, expected_offset * counts, atol=1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_the_span_is_that_of_the_columns_of_what_works(name: str) -> None:
    rng = np.random.default_rng(1)
    for number in range(2):
        robot = robot_of(name, number)
        work = robot.work()
        states = [
            np.zeros(robot.n, bool),
            np.arange(robot.n) == 0,
            np.arange(robot.n) == robot.n - 1,
        ]
        states += [rng.random(robot.n) < 0.4 for _ in range(3)]
        for lost in states:
            for free in (np.zeros(6, bool), np.arange(6) == 5, rng.random(6) < 0.4):
                if lost.all() or free.all():
                    continue
                check_span(robot, span_of(robot, work, lost, free), lost, free)


@pytest.mark.parametrize("name", ["rudders", "mixed"])
def test_a_state_that_was_asked_for_before_is_the_same_again(name: str) -> None:
    robot = robot_of(name)
    work = robot.work()
    whole = np.zeros(robot.n, bool)
    none = np.zeros(6, bool)
    first = bytes(span_of(robot, work, whole, none))
    lost = np.arange(robot.n) == 1
    assert bytes(span_of(robot, work, lost, none)) != first
    assert bytes(span_of(robot, work, whole, np.arange(6) == 2)) != first
    assert bytes(span_of(robot, work, whole, none)) == first
