"""Golden robots of the core's tests in C.

`python -m tests.golden_robots` writes finlab/core/tests/golden_*.h.

Each has a robot's block with few knots, and questions with what an oracle says that has no part of
the core: least power by Clarabel on power cones or by BFGS on the dual, how far a wrench goes by a
linear program, the least miss by nonnegative least squares.
"""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from finlab import core
from finlab.allocation.dual.compiled import Compiled
from finlab.arrays import Array
from finlab.core.fields import head_of
from finlab.deploy.thin_block import thinned
from tests.oracle_optima import conic_optimum, farthest, least_miss, lower_bound
from tests.oracle_plant import OraclePlant
from tests.random_robots import bluerov2_heavy, load, random_robot, with_rates, within

TEST_FOLDER = Path(core.__path__[0]) / "tests"
"""Where the core's tests in C stand."""
N_QUESTIONS = 6
"""Questions of each robot."""
TIMES_BEYOND = 1.7
"""How many times as far as a robot pushes the second wrench of each question is."""


class Question(NamedTuple):
    """Two wrenches along one direction, and what oracles say of them."""

    within: Array
    """A wrench (6,) within reach [N, N m]."""
    power: float
    """Least power for it [W], with wide arcs halved in all ways."""
    beyond: Array
    """A wrench (6,) out of reach."""
    ray_share: float
    """Largest share of that which can be given."""
    miss: float
    """Least distance from it, over the wrench scale."""


def _question(plant: OraclePlant, rng: np.random.Generator) -> Question:
    """A random question with what the oracles say to it."""
    wrench = within(plant, rng, 0.2, 0.9)
    if all(actuator.kind == "thruster" for actuator in plant.actuators):
        power = conic_optimum(plant, wrench)[0]
    else:
        power = lower_bound(plant, wrench)
    beyond = TIMES_BEYOND * farthest(plant, wrench) * wrench
    return Question(wrench, power, beyond, farthest(plant, beyond), least_miss(plant, beyond))


def _numbers(values: Array) -> str:
    """Numbers as an initializer of an array in C, four in a line."""
    texts = [repr(float(value)) for value in values]
    rows = [", ".join(texts[k : k + 4]) for k in range(0, len(texts), 4)]
    return ",\n    ".join(rows)


def _struct(question: Question) -> str:
    """A question as an initializer of a struct in C."""
    parts = [
        "{" + _numbers(question.within) + "}",
        repr(float(question.power)),
        "{" + _numbers(question.beyond) + "}",
        repr(float(question.ray_share)),
        repr(float(question.miss)),
    ]
    return "  {" + ",\n   ".join(parts) + "},"


def header(name: str, layout: dict[str, Any], seed: int) -> str:
    """Returns the text of a golden robot's header.

    Args:
        name: of the robot, part of its names in C.
        layout: mapping of its layout file.
        seed: of its questions.
    """
    plant = OraclePlant(layout)
    has_no_gaps = not any(actuator.kind == "fin" for actuator in plant.actuators)
    rng = np.random.default_rng(seed)
    block = thinned(Compiled.of(load(layout)).block)
    plant.scales = head_of(block)[
        "wrench_scale"
    ].copy()  # both measure a miss by the same wrench scale
    questions = [_question(plant, rng) for _ in range(N_QUESTIONS)]
    columns = plant.effectiveness.T
    lines = [
        "/* Written by tests/golden_robots.py: a block, and questions with the answers of "
        "oracles. */",
        '#include "golden.h"',
        "",
        f"static const fl_real {name}_block[] = {{\n  {_numbers(block)}\n}};",
        "",
        "/* Wrench of a newton along each direction of each actuator, by the layout file alone. */",
        f"static const fl_real {name}_effectiveness[][6] = {{",
        *(f"  {{{_numbers(column)}}}," for column in columns),
        "};",
        "",
        f"static const golden_question {name}_questions[] = {{",
        *map(_struct, questions),
        "};",
        "",
        f"static const golden_robot {name} = {{",
        f'  "{name}", {name}_block, (int)(sizeof {name}_block / sizeof *{name}_block),',
        f"  {name}_questions, (int)(sizeof {name}_questions / sizeof *{name}_questions),",
        f"  {name}_effectiveness, {int(has_no_gaps)}",
        "};",
        "",
    ]
    return "\n".join(lines)


def headers() -> dict[str, str]:
    """Returns the text of each golden robot's header by its file's name."""
    robots = {
        "thrusters": with_rates(bluerov2_heavy()),
        "pods": with_rates(random_robot("azimuths", 1, 7)),
        "fins": random_robot("fins", 0, 7),
        "arcs": random_robot("wide arcs", 1, 7),
    }
    return {f"golden_{name}.h": header(name, layout, seed=3) for name, layout in robots.items()}


if __name__ == "__main__":
    for file_name, text in headers().items():
        (TEST_FOLDER / file_name).write_text(text)
        print(TEST_FOLDER / file_name)
