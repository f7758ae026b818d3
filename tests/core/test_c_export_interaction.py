"""Exports to C of robots whose actuators act on each other: their answers are the library's."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import finlab
from finlab import Allocator, Azimuth, Layout, PowerLaw
from finlab.arrays import Array
from finlab.deploy.c_sources import c_sources, write_c
from finlab.errors import AllocationError
from finlab.interaction.interaction import InteractionModel
from finlab.interaction.jets import Jets
from finlab.interaction.learned import Learned
from finlab.interaction.linear import Linear
from finlab.physics import Plant
from tests.core.test_c_export import ran

STRICT = "-std=c99 -O1 -ffp-contract=off -Wall -Wextra -Werror -Wdouble-promotion -Wshadow"
"""Options of the compiler."""
TARGETS = 100
"""Wrenches that the library and the program are asked for."""
PROGRAM = """#include "robot.h"
#include <stdio.h>

static fl_work work;
static fl_answer answer;

int main(void) {
  fl_policy policy = {FL_DIRECTION, 0, {1, 1, 1, 1, 1, 1}, {{0}}};
  fl_question question = {.policy = &policy};
  double *w = question.wrench;
  if (fl_check(robot, robot_length) || robot_prepare(&work)) return 1;
  while (scanf("%lf %lf %lf %lf %lf %lf", w, w + 1, w + 2, w + 3, w + 4, w + 5) == 6) {
    if (robot_answer(&work, &question, &answer)) return 2;
    for (int i = 0; i < ROBOT_COUNT; i++)
      for (int k = 0; k < 3; k++) printf("%.17g ", answer.command[i][k]);
    printf("\\n");
  }
  return 0;
}
"""
"""Answers the wrenches of its input."""


def pods(interaction: InteractionModel) -> Layout:
    """Four pods on a hull's corners, with jets that meet each other."""
    parts = [
        Azimuth(
            f"p{i}",
            (x, y, z),
            (0.0, 0.0, 1.0),
            (1.0, 0.0, 0.0),
            (0.0, 50.0),
            PowerLaw(1.0),
            diameter=0.1,
        )
        for i, (x, y, z) in enumerate(
            [(0.4, 0.2, 0.0), (0.4, -0.2, 0.05), (-0.4, 0.2, 0.0), (-0.4, -0.2, -0.05)]
        )
    ]
    return Layout("pods", tuple(parts), axes=("Fx", "Fy", "Tz"), interaction=interaction)


def heavy(interaction: InteractionModel) -> Layout:
    """Eight thrusters."""
    return replace(finlab.load_layout("bluerov2_heavy"), interaction=interaction)


def targets_of(layout: Layout) -> Array:
    """Wrenches (N, 6) within reach, of random commands."""
    plant = Plant(layout)
    rng = np.random.default_rng(5)
    return plant.wrench(plant.sample(rng, (TARGETS,))) * layout.commanded


@pytest.mark.parametrize(
    "layout", [heavy(Linear()), heavy(Jets()), pods(Linear())], ids=["heavy", "jets", "pods"]
)
def test_answers_are_the_librarys(layout: Layout, tmp_path: Path) -> None:
    write_c(c_sources(layout, 24), tmp_path)
    said = ran(f"gcc {STRICT} *.c -lm -o selftest && ./selftest", tmp_path)
    assert said.startswith("0 of 24 ")

    (tmp_path / "selftest.c").unlink()
    (tmp_path / "main.c").write_text(PROGRAM)
    targets = targets_of(layout)
    np.savetxt(tmp_path / "targets", targets)
    printed = ran(f"gcc {STRICT} *.c -lm -o it && ./it < targets", tmp_path)
    numbers = np.array(printed.split(), float).reshape(TARGETS, layout.n, 3)

    plant = Plant(layout)
    scale = Allocator(layout).scale
    expected = Allocator(layout).allocate_batch(targets)
    command = np.where(np.isnan(layout.lower), np.nan, numbers)
    power = plant.power(np.nan_to_num(command)).sum(axis=1)
    assert np.abs(power / expected.power - 1.0).max() <= 1e-9
    missed = np.linalg.norm((plant.wrench(numbers) - targets) * layout.commanded / scale, axis=1)
    assert np.abs(missed - expected.err_norm).max() <= 1e-9


def test_single_precision_is_refused_when_it_is_compiled(tmp_path: Path) -> None:
    write_c(c_sources(heavy(Linear()), 1), tmp_path)
    ran("gcc -std=c99 -DFL_SINGLE -c robot.c 2> said; test $? -ne 0", tmp_path)
    assert "need double precision" in (tmp_path / "said").read_text()


def test_an_interaction_that_is_no_formula_of_the_core_is_refused() -> None:
    class InPython(Learned):
        def of(self, geometry):  # type: ignore[no-untyped-def]
            robot = Jets().of(geometry)

            class Other(type(robot)):  # type: ignore[misc]
                core_constants = None

            robot.__class__ = Other
            return robot

    with pytest.raises(AllocationError, match="formula is not in C"):
        c_sources(heavy(InPython("network")))


def test_an_export_is_the_same_on_every_machine() -> None:
    """It names no number of lanes but one, whatever this machine has."""
    source = c_sources(heavy(Jets()), 1)["robot.c"].decode()
    constants = source.split("constants[] = {\n")[1].split(",")
    assert [float(number) for number in constants[:5]] == [8.0, 1.0, 1000.0, 0.03, 1.0]


def test_robots_without_interaction_have_none_of_its_files() -> None:
    names = c_sources(finlab.load_layout("bluerov2_heavy"), 1).keys()
    assert not {"interaction.c", "jets.c", "outer_newton.c", "lanes_math.h"} & names
