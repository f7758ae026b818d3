"""The part of an export to C for a robot whose actuators act on each other: the numbers that the
core's `fl_answer_coupled` works with, and the functions that call it.

`finlab.deploy.c_sources` writes the rest of the export.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from finlab.allocation.dual.method import Dual
from finlab.allocation.dual.outer_iterations import wrench_offset_of
from finlab.arrays import Array
from finlab.errors import AllocationError

FILES_OF_INTERACTION = (
    "interaction.c",
    "interaction_kernel.h",
    "interaction_lanes.h",
    "jet_formulas.h",
    "jets.c",
    "jets.h",
    "lanes.h",
    "lanes_math.h",
    "lanes_scalar.c",
    "lanes_vector.h",
    "line_jets.c",
    "linear_interaction.c",
    "message_formulas.h",
    "messages.h",
    "outer_iterations.c",
    "outer_newton.c",
    "outer_reach.c",
    "outer_starts.c",
)
"""Files of the core that only robots with an interaction need."""
HEADERS = ("jets.h", "interaction_lanes.h")
"""Those of them that declare functions."""
DECLARATIONS = """
#ifdef FL_SINGLE
#error "the actuators act on each other: they need double precision; leave FL_SINGLE out"
#endif

/* The actuators act on each other. robot_linear is memory in which fl_answer_coupled keeps its
   linear model: one thread at a time may ask. */
#define robot_coupled fl_{name}_robot_coupled
#define robot_linear fl_{name}_robot_linear
#define robot_prepare fl_{name}_robot_prepare
#define robot_answer fl_{name}_robot_answer

extern const fl_coupled_robot robot_coupled;
extern fl_real robot_linear[];

/* As fl_prepare and fl_answer_one, of the robot with what its actuators do to each other. */
int robot_prepare(fl_work *work);
int robot_answer(fl_work *work, const fl_question *question, fl_answer *answer);
#define ROBOT_IS_COUPLED
"""
"""What robot.h has of such a robot."""
DECLARATIONS_WITHOUT = """
/* As fl_prepare and fl_answer_one. */
#define robot_prepare(work) fl_prepare(robot, work)
#define robot_answer(work, question, answer) fl_answer_one(robot, work, question, answer)
"""
"""What robot.h has of other robots."""
_FUNCTIONS = """
fl_real robot_linear[sizeof robot / sizeof *robot];

int robot_prepare(fl_work *work) {
  for (int k = 0; k < robot_length; k++) robot_linear[k] = robot[k];
  return fl_prepare(robot_linear, work);
}

int robot_answer(fl_work *work, const fl_question *question, fl_answer *answer) {
  fl_outer_result result;
  return fl_answer_coupled(&robot_coupled, robot_linear, work, question, answer, &result);
}
"""


def check_interaction(method: Dual) -> None:
    """Raises AllocationError: what the robot's actuators do to each other is no formula of the
    core."""
    offset = wrench_offset_of(method.plant, method.compiled)
    if offset.core_constants is None:
        layout = method.layout
        kind = getattr(layout.interaction, "type", "of your own")
        raise AllocationError(
            f"layout {layout.name!r}: has an `interaction` {kind!r}, whose formula is not in C; "
            "the C files know `linear` and `jets`: `finlab fit interaction` makes a `linear` one "
            "of samples"
        )


def coupled_source(method: Dual, array: Callable[[Array, Any], str]) -> str:
    """Returns what robot.c has of an interaction, in double precision.

    Args:
        method: of the robot, in its flow.
        array: writes numbers of a type as the inside of an array.
    """
    interaction = method.plant.interaction
    assert interaction is not None
    offset = wrench_offset_of(method.plant, method.compiled)
    constants = interaction.constants_in_lanes(1)
    assert constants is not None
    assert offset.starts is not None
    arrays = {"constants": constants, "frames": offset.frames, "starts": offset.starts}
    if offset.inflow is not None:
        arrays["inflow"] = offset.inflow
    if len(method.coupled.line_jets):
        arrays["line_jets"] = method.coupled.line_jets
    parts = []
    for name, numbers in arrays.items():
        flat = np.ravel(numbers)
        parts += [f"static const fl_real {name}[] = {{", array(flat, float), "};"]
    counts = ", ".join(str(int(counts)) for counts in offset.counts)
    fields = (
        offset.core_function,
        "constants",
        "inflow" if "inflow" in arrays else "0",
        "robot",
        "line_jets" if "line_jets" in arrays else "0",
        "frames",
        f"{{{counts}}}",
        "starts",
        str(len(offset.starts)),
    )
    parts.append(f"const fl_coupled_robot robot_coupled = {{{', '.join(fields)}}};")
    return "\n".join(parts) + "\n" + _FUNCTIONS
