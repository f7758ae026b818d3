"""What `fl_check` of the core refuses: each number of a block that makes no sense, with its
code."""

from typing import Any

import numpy as np
import pytest

from finlab.arrays import Array
from finlab.core import library
from finlab.core.fields import actuators_of, constant, head_of, tables_begin
from tests.core.internal_functions import FIN, POD, Robot, robot_of

FOIL = constant("FL_FOIL")
"""The kind of a rudder's command."""


def code_of(block: Array, length: int | None = None) -> str:
    """The name of the code with which a block is refused, or FL_OK."""
    if length is None:
        length = len(block)
    code = library().fl_check(block.ctypes.data, length)
    names = ("FL_OK", "FL_BAD_BLOCK", "FL_BAD_VERSION", "FL_BAD_NUMBER", "FL_BAD_ARGUMENT")
    return {constant(name): name for name in names}[code]


def first_of(robot: Robot, kind: int) -> int:
    """The first actuator of a robot whose command is of a kind."""
    return int(np.flatnonzero(robot.actuators["command_kind"] == kind)[0])


def test_robots_of_every_kind_pass() -> None:
    for name in ("thrusters", "azimuths", "fins uneven", "wide arcs", "holes", "rudders", "all"):
        assert code_of(robot_of(name).block) == "FL_OK"


@pytest.mark.parametrize(
    ("field", "value", "refused"),
    [
        ("magic", 41720.0, "FL_BAD_BLOCK"),
        ("version", constant("FL_VERSION") - 1.0, "FL_BAD_VERSION"),
        ("version", constant("FL_VERSION") + 1.0, "FL_BAD_VERSION"),
        ("n", 0.0, "FL_BAD_BLOCK"),
        ("n", -1.0, "FL_BAD_BLOCK"),
        ("n", 1.5, "FL_BAD_BLOCK"),
        ("n", constant("FL_MOST") + 1.0, "FL_BAD_BLOCK"),
        ("rank", -1.0, "FL_BAD_BLOCK"),
        ("rank", 1.5, "FL_BAD_BLOCK"),
        ("rank", 7.0, "FL_BAD_BLOCK"),
        ("length", 1e6, "FL_BAD_BLOCK"),
    ],
)
def test_a_head_with_a_wrong_number_is_refused(field: str, value: float, refused: str) -> None:
    block = robot_of("thrusters").block.copy()
    head_of(block)[field] = value
    assert code_of(block) == refused


@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("axis_scale", 0.0),
        ("axis_scale", -1.0),
        ("wrench_scale", 0.0),
        ("wrench_scale", -1.0),
        ("is_commanded", 0.5),
        ("is_commanded", 2.0),
        ("wrench_offset", 2e30),
        ("wrench_offset", -2e30),
    ],
)
def test_a_number_of_one_axis_is_refused(field: str, value: float, axis: int) -> None:
    block = robot_of("thrusters").block.copy()
    head_of(block)[field][axis] = value
    assert code_of(block) == "FL_BAD_NUMBER"


def test_a_block_of_another_length_is_refused() -> None:
    block = robot_of("thrusters").block
    assert code_of(block, len(block) - 1) == "FL_BAD_BLOCK"
    for length in (0, 1, tables_begin(0) - 1):
        assert code_of(block, length) == "FL_BAD_BLOCK"
    # The head says the right length, but has more actuators than it has room for.
    short = block[: tables_begin(robot_of("thrusters").n) - 1].copy()
    head_of(short)["length"] = len(short)
    assert code_of(short) == "FL_BAD_BLOCK"


@pytest.mark.parametrize("name", ["azimuths", "fins uneven", "rudders"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_every_number_of_a_block_is_finite(name: str, bad: float) -> None:
    """Every field of the head and of every actuator, and fifty numbers of the tables."""
    block = robot_of(name).block
    first_of_tables = tables_begin(robot_of(name).n)
    in_tables = np.random.default_rng(0).integers(first_of_tables, len(block), 50)
    for index in [*range(first_of_tables), *in_tables.tolist()]:
        damaged = block.copy()
        damaged[index] = bad
        assert code_of(damaged) != "FL_OK", f"number {index} is {bad}"


@pytest.mark.parametrize("i", [0, -1])
@pytest.mark.parametrize(
    ("field", "value", "refused"),
    [
        ("rows", 0.0, "FL_BAD_BLOCK"),
        ("rows", 3.0, "FL_BAD_BLOCK"),
        ("command_kind", -1.0, "FL_BAD_BLOCK"),
        ("command_kind", 0.5, "FL_BAD_BLOCK"),
        ("command_kind", FOIL + 1.0, "FL_BAD_BLOCK"),
        ("force_table", 0.0, "FL_BAD_BLOCK"),
        ("force_table", 0.5, "FL_BAD_BLOCK"),
        ("force_table_reverse", -1.0, "FL_BAD_BLOCK"),
        ("gauge_table", 1e9, "FL_BAD_BLOCK"),
        ("law_grid", 300.0, "FL_BAD_BLOCK"),
        ("flow_speed", 1.0, "FL_BAD_BLOCK"),
        ("flow_speed", -1.0, "FL_BAD_NUMBER"),
        ("force_scale", 0.0, "FL_BAD_NUMBER"),
        ("power_scale", 0.0, "FL_BAD_NUMBER"),
        ("force_min", 1e6, "FL_BAD_NUMBER"),
        ("sector_half_angle", -0.1, "FL_BAD_NUMBER"),
        ("dead_band", -0.1, "FL_BAD_NUMBER"),
        ("uncertainty_cost", -0.1, "FL_BAD_NUMBER"),
        ("secant", -0.1, "FL_BAD_NUMBER"),
        ("row_force_max", 0.0, "FL_BAD_NUMBER"),
        ("max_change", -0.1, "FL_BAD_NUMBER"),
        ("command_min", 1e6, "FL_BAD_NUMBER"),
        ("effectiveness_normalized", np.nan, "FL_BAD_NUMBER"),
    ],
)
def test_a_thruster_with_a_wrong_number_is_refused(
    field: str, value: float, refused: str, i: int
) -> None:
    block = robot_of("thrusters").block.copy()
    actuators_of(block)[field][i] = value
    assert code_of(block) == refused


def test_the_largest_price_of_a_table_is_above_zero() -> None:
    robot = robot_of("thrusters")
    for field in ("force_table", "force_table_reverse"):
        offset = int(robot.actuators[field][0])
        if offset > 0:
            block = robot.block.copy()
            block[offset] = 0.0
            assert code_of(block) == "FL_BAD_NUMBER"


def test_numbers_of_a_command_that_its_kind_does_not_use_are_zero() -> None:
    """A thruster uses one, a pod two, a fin three, a foil one."""
    for name, kind, used in (
        ("thrusters", 0, 1),
        ("azimuths", POD, 2),
        ("fins", FIN, 3),
        ("rudders", FOIL, 1),
    ):
        robot = robot_of(name)
        i = first_of(robot, kind)
        for k in range(3):
            block = robot.block.copy()
            actuators = actuators_of(block)
            if k < used:  # an empty range
                actuators["command_min"][i, k] = actuators["command_max"][i, k] + 1.0
            else:
                actuators["command_max"][i, k] = 1.0
            assert code_of(block) == "FL_BAD_NUMBER", (name, k)


def test_the_tables_that_a_kind_needs_are_there() -> None:
    for name, kind in (("fins", FIN), ("rudders", FOIL)):
        robot = robot_of(name)
        i = first_of(robot, kind)
        for field in ("command_table", "law_grid"):
            for offset in (0.0, -1.0, len(robot.block) - 1.0):
                block = robot.block.copy()
                actuators_of(block)[field][i] = offset
                assert code_of(block) == "FL_BAD_BLOCK", (name, field, offset)


@pytest.mark.parametrize("name", ["fins", "rudders"])
def test_a_grid_with_a_wrong_number_is_refused(name: str) -> None:
    """Counts of knots, the period, the columns, and knots that do not ascend."""
    robot = robot_of(name)
    grid = int(robot.actuators["law_grid"][first_of(robot, FIN if name == "fins" else FOIL)])
    counts = robot.block[grid : grid + 3].astype(int)
    spoiled = [(0, 0.0), (1, 0.5), (2, 1e6), (3, -1.0), (5, 0.0), (5, 4.0)]
    for index, value in spoiled:
        block = robot.block.copy()
        block[grid + index] = value
        assert code_of(block) == "FL_BAD_BLOCK", (index, value)
    first_knot = grid + 7
    for count in counts:
        if count > 1:
            block = robot.block.copy()
            block[first_knot + 1] = block[first_knot]
            assert code_of(block) == "FL_BAD_BLOCK"
        first_knot += count
    # A period has to be wider than the knots of the third axis.
    last_axis = robot.block[first_knot - counts[2] : first_knot]
    for share, refused in ((0.99, "FL_BAD_BLOCK"), (1.01, "FL_OK")):
        if counts[2] > 1:
            block = robot.block.copy()
            block[grid + 3] = share * (last_axis[-1] - last_axis[0])
            assert code_of(block) == refused


@pytest.mark.parametrize(("field", "count"), [("secant", 2), ("max_change", 3)])
def test_each_of_several_numbers_is_looked_at(field: str, count: int) -> None:
    for k in range(count):
        block = robot_of("azimuths").block.copy()
        actuators_of(block)[field][1, k] = -0.1
        assert code_of(block) == "FL_BAD_NUMBER", k
        actuators_of(block)[field][1, k] = 0.0
        assert code_of(block) == "FL_OK", k


TABLES = [
    ("force_table", "thrusters", 0, 1, lambda cells: 3 + 3 * (cells + 1)),
    ("force_table_reverse", "thrusters", 0, 1, lambda cells: 3 + 3 * (cells + 1)),
    ("gauge_table", "fins uneven", FIN, 0, lambda points: 1 + 4 * points),
    ("command_table", "fins", FIN, 0, lambda cells: 1 + 2 * (cells + 1)),
    ("command_table", "rudders", FOIL, 0, lambda points: 1 + 2 * points),
]
"""Fields of offsets, a robot and a kind that have such a table, which of its numbers is the count,
and how many numbers there are for a count."""


@pytest.mark.parametrize("table", TABLES)
def test_a_table_at_the_end_of_a_block_is_whole_or_refused(table: tuple[Any, ...]) -> None:
    field, name, kind, count_index, length_of = table
    robot = robot_of(name)
    i = first_of(robot, kind)
    offset = int(robot.actuators["force_table" if field.startswith("force") else field][i])
    numbers = robot.block[offset : offset + length_of(int(robot.block[offset + count_index]))]

    def with_table(table_numbers: Array) -> Array:
        block = np.concatenate([robot.block, table_numbers])
        head_of(block)["length"] = len(block)
        actuators_of(block)[field][i] = len(robot.block)
        return np.asarray(block)

    assert code_of(with_table(numbers)) == "FL_OK"
    assert code_of(with_table(numbers[:-1])) == "FL_BAD_BLOCK"
    for count in (0.0, -1.0, 1.5, numbers[count_index] + 1.0, 65537.0):
        spoiled = numbers.copy()
        spoiled[count_index] = count
        assert code_of(with_table(spoiled)) == "FL_BAD_BLOCK", count
    if field.startswith("force"):
        spoiled = numbers.copy()
        spoiled[0] = 0.0
        assert code_of(with_table(spoiled)) == "FL_BAD_NUMBER"


@pytest.mark.parametrize("columns", [1, 2, 3])
def test_a_grid_at_the_end_of_a_block_is_whole_or_refused(columns: int) -> None:
    robot = robot_of("fins")
    i = first_of(robot, FIN)
    knots = [np.arange(count) + 0.5 for count in (2, 3, 4)]
    header = [2.0, 3.0, 4.0, 10.0, 0.0, columns, 0.0]
    values = np.zeros(24 * columns)
    grid = np.concatenate([header, *knots, values])

    def with_grid(numbers: Array) -> Array:
        block = np.concatenate([robot.block, numbers])
        head_of(block)["length"] = len(block)
        actuators_of(block)["law_grid"][i] = len(robot.block)
        return np.asarray(block)

    assert code_of(with_grid(grid)) == "FL_OK"
    assert code_of(with_grid(grid[:-1])) == "FL_BAD_BLOCK"
    for count in range(1, 7):
        assert code_of(with_grid(grid[:count])) == "FL_BAD_BLOCK"
    for k in range(3):
        longer = grid.copy()
        longer[k] += 1.0
        assert code_of(with_grid(longer)) == "FL_BAD_BLOCK"
    # Every pair of neighbours on every axis ascends.
    place = 7
    for axis in knots:
        for j in range(1, len(axis)):
            level = grid.copy()
            level[place + j] = level[place + j - 1]
            assert code_of(with_grid(level)) == "FL_BAD_BLOCK"
        place += len(axis)
    for period, passes in ((2.9, False), (3.0, False), (3.1, True), (0.0, True)):
        other = grid.copy()
        other[3] = period
        assert (code_of(with_grid(other)) == "FL_OK") == passes, period


def test_a_fin_or_a_thruster_in_a_flow_is_no_foil() -> None:
    """Drag has a price of its own on foils of two rows alone."""
    robot = robot_of("rudders")
    i = first_of(robot, FOIL)
    assert robot.actuators["flow_speed"][i] > 0.0
    block = robot.block.copy()
    actuators_of(block)["rows"][i] = 1.0
    assert code_of(block) == "FL_BAD_BLOCK"
    actuators_of(block)["flow_speed"][i] = 0.0
    assert code_of(block) == "FL_OK"
    for name in ("azimuths", "fins"):
        block = robot_of(name).block.copy()
        assert actuators_of(block)["rows"][0] == 2.0
        actuators_of(block)["flow_speed"][0] = 1.0
        assert code_of(block) == "FL_BAD_BLOCK"


def test_a_thruster_has_no_grid_and_numbers_that_are_just_allowed_pass() -> None:
    robot = robot_of("thrusters")
    block = robot.block.copy()
    grid_of_fin = robot_of("fins")
    assert grid_of_fin.actuators["law_grid"][0] > 0.0
    own = actuators_of(block)
    own["force_max"][0] = own["force_min"][0]
    own["sector_half_angle"][0] = 0.0
    own["dead_band"][0] = 0.0
    own["command_max"][0] = own["command_min"][0]
    assert code_of(block) == "FL_OK"
    head_of(block)["rank"] = 0.0
    assert code_of(block) == "FL_OK"
    head_of(block)["wrench_offset"][5] = 1e30
    assert code_of(block) == "FL_OK"
