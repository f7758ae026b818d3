"""Exports an allocator as C99: the core, the robot's block, a self-test and examples.

`robot.c` holds two blocks: the library's own in double precision, and one with few knots in its
tables where FL_SINGLE is defined. The same layout gives the same bytes.
"""

import os
import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

import finlab
from finlab import core
from finlab.actuators.actuator import Kind
from finlab.actuators.propeller_rudder import PropellerRudder
from finlab.allocation.allocator import Allocator
from finlab.allocation.dual.compiled import core_policy
from finlab.allocation.dual.method import Dual, DualSettings
from finlab.allocation.policy import CLOSEST, Policy, PolicyName
from finlab.allocation.power_budget import PowerBudget, budget_of
from finlab.allocation.question import askable, check_flow
from finlab.arrays import NOTHING, Array
from finlab.axes import AXES
from finlab.core.calls import Conditions, budget_record
from finlab.core.fields import actuators_of, constant
from finlab.deploy.c_interaction import (
    DECLARATIONS,
    DECLARATIONS_WITHOUT,
    FILES_OF_INTERACTION,
    HEADERS,
    check_interaction,
    coupled_source,
)
from finlab.deploy.thin_block import tables_of, thinned
from finlab.errors import AllocationError
from finlab.layout import Layout
from finlab.physics.objective import wrench_scale_of
from finlab.whole_file import write_folder

SAMPLES = 24
"""Questions of a self-test."""
MARGIN_SAMPLES = 64
"""Questions that show how far powers by the core's tables are from those by the laws."""
MOST_MARGIN = 1.1
"""Power over a budget from which on the core has not kept it, rather than that tables are off."""
MAX_CORE_ERROR = 3e-7
"""Largest normalized error of the core's commands for a question of the self-test: beyond it the
library would refine them, and its answer were not the core's."""
FILES_LEFT_OUT = (
    "actuator_formulas.c",
    "messages.c",
    "ray_reach.c",
    "power_sets.c",
    "for_python.c",
    "prepared_call.c",
    "answer_many.c",
    "lanes_kernel.h",
    "lanes_baseline.c",
    "lanes_avx2.c",
    "lanes_avx512.c",
    "vehicle.c",
    "fin_motion.c",
    "first_order_lag.c",
    "jump_evidence.c",
    "jump_filter.c",
    "kalman_filter.c",
    "motion_model.c",
    "path_wrench.c",
)
"""Files of the core that an export does not need: judgement by formulas, messages of networks,
attainable sets, batches, what Python alone calls, and what swims in a simulation."""
FILES_OF_BUDGETS = ("command_budget.c", "power_budget.c")
"""Files of the core that only robots with a power budget need."""
QUESTIONS: tuple[tuple[PolicyName, float], ...] = (
    ("closest", 0.9),
    ("closest", 3.0),
    ("direction", 3.0),
    ("priority", 3.0),
    ("falling", 3.0),
    ("closest", 0.6),
)
"""Questions of a self-test in turn: policy, and factor of a wrench within reach; below 0.9 it is a
tick, with the command for half that wrench before it."""
TEMPLATES = Path(__file__).with_name("c_files")
"""Files that go into an export as they are, but for the README's fields."""
STUBS = Path(__file__).with_name("c_stubs")
"""Files that stand in place of others, in exports of robots that do not need them: a tenth of the
code."""
STUB_OF_FOILS = "foil_drag.c"
"""Stands in their place for other robots."""
STUB_OF_PODS = "turning_cost.c"
"""Stands in place of the file of that name for robots without pods, whose turning costs nothing."""
FILES_OF_FOILS = (
    "foil_arcs.c",
    "foil_choices.c",
    "foil_drag.c",
    "foil_jump.c",
    "foil_lattice.c",
    "foil_steps.c",
    "foil_tangent.c",
    "foil_vertices.c",
)
"""Files of the core that only robots with foils in a flow need."""


def c_sources(
    layout: Layout, samples: int = SAMPLES, flow: ArrayLike | None = None
) -> dict[str, bytes]:
    """Returns the files of an export by name: the core, `robot.c` and `robot.h`, a self-test, a
    README, CMakeLists.txt and examples.

    Args:
        layout: the robot.
        samples: how many questions the self-test has.
        flow: velocity relative to the water (6,) [m/s, rad/s], body frame, for which the block
            holds: foils push by it, propellers lose to it. None for a robot at rest.

    Raises:
        AllocationError: the actuators act on each other by no formula of the core, or the layout
            has a power budget that is not kept for such a robot.
        CommandError: `flow` is not six finite numbers.
        DataError: a force table cannot be read.
    """
    water = check_flow(flow)
    method = Dual(layout, DualSettings(), wrench_scale_of(layout), None).at(water)
    is_coupled = layout.interaction is not None
    if is_coupled:
        check_interaction(method)
    budget = budget_of(layout)
    margin = 0.0
    if budget is not None:
        method.check_budget(budget, CLOSEST)
        _check_slipstreams(layout)
        margin = _budget_margin(method, budget)
        budget = PowerBudget(budget.names, budget.members, budget.watts / (1.0 + margin))
    block = method.compiled.block
    thin = thinned(block)
    foils = int((actuators_of(block)["flow_speed"] > 0.0).sum())
    sources = _core_sources(layout, foils > 0, budget is not None, is_coupled)
    headers = ["finlab.h", "internal.h", *(HEADERS if is_coupled else ())]
    name = _identifier(layout.name)
    declared = "".join(sources[header] for header in headers)
    sources["fl_names.h"] = _prefixed_names(declared, name)
    zones = int(actuators_of(block)["barred_count"].max(initial=0.0))
    is_steered = actuators_of(block)["command_kind"] == constant("FL_STEERED")
    has_gauges = bool((actuators_of(block)["gauge_table"] > 0.0).any())
    aims = any(actuator.KIND.aiming_number is not None for actuator in layout.actuators)
    size = ExportSize(layout.n, foils, zones, bool(is_steered.any()), has_gauges, aims)
    sources["finlab.h"] = _with_size(sources["finlab.h"], size, is_coupled)
    if budget is None:
        sources["finlab.h"] = _without_budgets(sources["finlab.h"])
    sources["robot.c"] = _robot(block, thin)
    if budget is not None:
        sources["robot.c"] += "\n" + _budget_source(budget)
    if is_coupled:
        sources["robot.c"] += "\n" + coupled_source(method, _block)
    sources["robot.h"] = _header(layout, name)
    sources[f"fl_{name}.h"] = _plain_header(layout, name)
    sources["allocate.c"] = _plain_source(layout, name)
    sources["samples.h"] = _self_test(layout, method, samples)
    for path in TEMPLATES.rglob("*.*"):
        sources[path.relative_to(TEMPLATES).as_posix()] = path.read_text("utf-8")
    law = max(sum(len(table.numbers) for table in row.values()) for row in tables_of(thin))
    sources["README.md"] = sources["README.md"].format(
        name=layout.name,
        identifier=name,
        version=finlab.__version__,
        count=layout.n,
        samples=samples,
        double=8 * len(block),
        single=4 * len(thin),
        law=4 * law,
        budget=_budget_words(budget, margin, name),
        axes=", ".join(np.array(AXES)[layout.commanded]),
        flow="at rest"
        if water is None
        else f"with ({', '.join(f'{v:g}' for v in water)}) m/s, rad/s",
    )
    return {name: text.encode() for name, text in sorted(sources.items())}


def write_c(files: dict[str, bytes], folder: str | os.PathLike[str]) -> None:
    """Writes the files of an export into a folder, which is made; an earlier export is replaced.

    Args:
        files: contents by name.
        folder: the folder.

    Raises:
        DataError: the folder has other C files, or cannot be written.
    """
    foreign = (file for file in Path(folder).glob("*.[ch]") if file.name not in files)
    write_folder(folder, files, foreign, "an export")


def _core_sources(
    layout: Layout, has_foils: bool, has_budget: bool, is_coupled: bool
) -> dict[str, str]:
    """The files of the core that a robot needs, and stubs in place of others, by name."""
    folder = Path(core.__path__[0])
    files = [*folder.glob("*.h"), *folder.glob("src/*.[ch]")]
    sources = {
        path.name: path.read_text("utf-8") for path in files if path.name not in FILES_LEFT_OUT
    }
    if not has_foils:
        for file in FILES_OF_FOILS:
            del sources[file]
        sources[STUB_OF_FOILS] = (STUBS / STUB_OF_FOILS).read_text("utf-8")
    if not any(_is_pod(actuator.KIND) for actuator in layout.actuators):
        sources[STUB_OF_PODS] = (STUBS / STUB_OF_PODS).read_text("utf-8")
    if not has_budget:
        for name in FILES_OF_BUDGETS:
            del sources[name]
    if not is_coupled:
        for file in FILES_OF_INTERACTION:
            del sources[file]
    return sources


def _is_pod(kind: Kind) -> bool:
    """Whether the command of a kind is a force and its angle, whose turning costs in ticks."""
    return kind.aiming_number is not None and kind.force_number is not None


class ExportSize(NamedTuple):
    """What of the core the code of a robot needs."""

    actuators: int
    """How many."""
    foils: int
    """Of those, how many may stall."""
    zones: int
    """Most barred zones of a pod."""
    has_slipstreams: bool
    """Whether a rudder stands in the slipstream of a propeller."""
    has_gauges: bool
    """Whether the force of a fin differs by its direction."""
    aims: bool
    """Whether some actuator turns to aim its force."""


def _with_size(header: str, size: ExportSize, is_coupled: bool) -> str:
    """finlab.h for a robot of this size. In single precision where a processor has no unit for
    double, but for robots whose actuators act on each other, which have no lanes of vectors."""
    values = {
        "FL_MOST": size.actuators,
        "FL_ARCS": min(size.foils, constant("FL_ARCS")),
        "FL_ZONES": size.zones,
        "FL_SLIPSTREAMS": int(size.has_slipstreams),
        "FL_GAUGES": int(size.has_gauges),
        "FL_COUPLES": int(is_coupled),
        "FL_AIMS": int(size.aims),
    }
    for name, value in values.items():
        header = re.sub(rf"(#define {name}) \d+", rf"\1 {value}", header, count=1)
    if is_coupled:
        return header.replace("#ifdef FL_SINGLE\n", "#define FL_NO_LANES\n#ifdef FL_SINGLE\n", 1)
    single = (
        "#if defined(__ARM_FP) && !(__ARM_FP & 8) && !defined(FL_SINGLE)\n#define "
        "FL_SINGLE\n#endif\n\n"
    )
    return header.replace("#ifdef FL_SINGLE\n", f"{single}#ifdef FL_SINGLE\n", 1)


def _budget_margin(method: Dual, budget: PowerBudget) -> float:
    """The share by which powers by the laws may be above those of the core's tables, by which the
    export keeps its budgets: twice what random questions show; 0 where tables are exact."""
    if method.has_exact_power:
        return 0.0
    rng = np.random.default_rng(1)
    most = 0.0
    for wrench in method.plant.wrench(method.plant.sample(rng, (MARGIN_SAMPLES,))):
        target = askable(wrench * method.layout.commanded)[None]
        free = method.compiled.forces(target, CLOSEST).command
        taken = budget.power_of_buses(method.plant.power(free))[0]
        watts = np.maximum(taken * rng.uniform(0.3, 0.9), NOTHING)
        conditions = Conditions(budget=budget_record(budget.members, watts))
        command = method.compiled.forces(target, CLOSEST, None, conditions).command
        kept = budget.power_of_buses(method.plant.power(command))[0] / watts
        if (
            kept.max() < MOST_MARGIN
        ):  # else the core has found nothing within the budget, and says so
            most = max(most, float(kept.max()) - 1.0)
    return 2.0 * most


def _check_slipstreams(layout: Layout) -> None:
    """Refuses a robot with rudders in slipstreams, whose budgets the core alone does not keep."""
    for actuator in layout.actuators:
        if isinstance(actuator, PropellerRudder):
            raise AllocationError(
                f"power: no budget is kept yet by exports to C of robots with a rudder in a "
                f"slipstream ({actuator.name}); leave out `power_w` and `buses`, or scale the "
                "wrench down on board"
            )


def _without_budgets(header: str) -> str:
    """finlab.h of a robot without a power budget, which needs no code for one."""
    return header.replace("#define FL_KEEPS_BUDGETS 1", "#define FL_KEEPS_BUDGETS 0", 1)


def _budget_words(budget: PowerBudget | None, margin: float, identifier: str) -> str:
    """What the README says of the power budget of a robot, with its name in C."""
    if budget is None:
        return "The layout has no power budget, and `question.budget` is refused."
    buses = ", ".join(
        f"{name} {watts:.6g} W" for name, watts in zip(budget.names, budget.watts, strict=True)
    )
    words = (
        f"`question.budget = ROBOT_BUDGET;` keeps the power within the layout's budget ({buses}), "
        "as the function `allocate` of the plain header does. `answer.exceeds_budget` says where "
        "that was not found, or rates forbid it; `allocate` then writes the commands and returns "
        f"`FL_{identifier.upper()}_OVER_BUDGET`, which is not 0."
    )
    if margin > 0.0:
        words += (
            f" It is {100.0 * margin:.2g} % below the budget of the layout: by so much powers "
            "by the laws may be above those of the tables here."
        )
    return words


def _budget_source(budget: PowerBudget) -> str:
    """The budget of robot.c: the most that each bus may take, and which bus feeds an actuator."""
    bus_of = budget.record["bus_of"][0][: budget.members.shape[1]]
    names = ", ".join(budget.names)
    return (
        f"/* Buses: {names}. */\n"
        f"const fl_budget robot_budget = {{{len(budget.watts)}, {_row(budget.watts)}, "
        f"{{{', '.join(map(str, bus_of.tolist()))}}}}};\n"
    )


def _row(values: Array) -> str:
    return "{" + ", ".join(repr(float(one)) for one in values) + "}"


def _rows(values: Array) -> str:
    return "{" + ", ".join(map(_row, values)) + "}"


def _block(values: Array, number: Any) -> str:
    texts = [str(number(value)) for value in values]
    return ",\n".join("  " + ", ".join(texts[k : k + 8]) for k in range(0, len(texts), 8))


def _identifier(name: str) -> str:
    """A layout's name as part of names in C."""
    return re.sub(r"[^a-z0-9]", "_", name.lower())


def _prefixed_names(headers: str, name: str) -> str:
    """fl_names.h, by which all functions of the core have the robot's name: two robots link into
    one program, each with a core of its own size."""
    functions = sorted(set(re.findall(r"\b(fl_[a-z_0-9]+)\(", headers)))
    lines = [f"#define {one} fl_{name}_{one.removeprefix('fl_')}" for one in functions]
    about = (
        "/* Names of this core's functions in the linker: with the robot's name two robots link "
        "into one\n"
        "   program. Your source says fl_answer_one. */"
    )
    return "\n".join([about, "#ifndef FL_NAMES_H", "#define FL_NAMES_H", *lines, "#endif", ""])


def _robot(block: Array, thin: Array) -> str:
    lines = [
        '#include "robot.h"',
        "",
        "/* See fl_fields.h. */",
        "const fl_real robot[] = {",
        "#ifdef FL_SINGLE",
        _block(thin, np.float32),
        "#else",
        _block(block, float),
        "#endif",
        "};",
        "const int robot_length = (int)(sizeof robot / sizeof *robot);",
        "",
    ]
    return "\n".join(lines)


def _rows_of_commands(layout: Layout, prefix: str) -> str:
    """An enumeration of the rows of commands, with the meaning of their numbers."""
    lines = []
    for name, actuator in zip(layout.names, layout.actuators, strict=True):
        numbers = ", ".join(number.label for number in actuator.KIND.numbers)
        lines.append(f"  {prefix}_{_identifier(name).upper()}, /* {name}: {numbers} */")
    rows = "\n".join(lines)
    return f"enum {{ /* rows of commands, and their numbers */\n{rows}\n  {prefix}_COUNT\n}};\n"


_HEADER = """/* The robot {title} for the functions of finlab.h. One robot a file; else see
   fl_{name}.h. */
#ifndef FL_ROBOT_H
#define FL_ROBOT_H
#include "finlab.h"

#ifdef __cplusplus
extern "C" {{
#endif

/* Short names of this robot. */
#define robot fl_{name}
#define robot_length fl_{name}_length
#define robot_selftest fl_{name}_selftest

extern const fl_real robot[];    /* its block of numbers */
extern const int robot_length;   /* how many */
int robot_selftest(void);        /* how many answers differ from the library's */
{coupled}{budget}#define ROBOT_HEAD ((const fl_head *)(const void *)robot)
#define ROBOT_ACTUATOR(i) ((const fl_actuator *)(const void *)(ROBOT_HEAD + 1) + (i))

{rows}
#ifdef __cplusplus
}}
#endif
#endif
"""

_BUDGET = """
/* What its buses may take, for fl_question.budget. */
#define robot_budget fl_{name}_budget
extern const fl_budget robot_budget;
#define ROBOT_BUDGET (&robot_budget)
"""
_WITHOUT_BUDGET = """
/* For fl_question.budget: this robot has no power budget. */
#define ROBOT_BUDGET 0
"""
_PLAIN_HEADER = """/* The robot {title} in three functions, for C and C++.
   A program may have several robots. */
#ifndef FL_{upper}_H
#define FL_{upper}_H
#ifdef __cplusplus
extern "C" {{
#endif

{rows}{budget}
/* Finds commands of least power for a wrench; beyond reach those that give the largest share of
   it. Not for several threads at once.

   @param wrench    (6,) Fx, Fy, Fz [N], Tx, Ty, Tz [N m], body frame: x forward, y left, z up
   @param previous  (count, 3) commands of the tick before, from which rates hold; 0 for none
   @param command   (count, 3) becomes the commands; unused numbers are 0
   @return          0, or a code for fl_{name}_error_text; then the commands are as they
                    were{but} */
int fl_{name}_allocate(const double *wrench, const double (*previous)[3], double (*command)[3]);

/* @return a sentence that says what is wrong and what to do */
const char *fl_{name}_error_text(int code);

/* @return how many of the self-test's answers differ from the library's; selftest.c has it */
int fl_{name}_selftest(void);

#ifdef __cplusplus
}}
#endif
#endif
"""

_PLAIN_BUDGET = """
/* What `allocate` returns where the commands are written, but take more power than a bus may give:
   rates forbid less in this tick, or none was found. */
#define FL_{upper}_OVER_BUDGET {code}
"""
_PLAIN_SOURCE = """#include "robot.h"
#include "fl_{name}.h"

#define CALM ((fl_real){calm!r}) /* what turning costs in a tick */

static fl_work work;
static fl_answer answer;
static int is_prepared;

int fl_{name}_allocate(const double *wrench, const double (*previous)[3], double (*command)[3]) {{
  fl_real before[ROBOT_COUNT][3];
  const fl_policy policy = {{FL_DIRECTION, 0, {{1, 1, 1, 1, 1, 1}}, {{{{0}}}}}};
  fl_question question = {{.calm = CALM}};
  if (!is_prepared) {{
    int code = fl_check(robot, robot_length);
    if (!code) code = robot_prepare(&work);
    if (code) return code;
    is_prepared = 1;
  }}
  question.policy = &policy;
  question.budget = ROBOT_BUDGET;
  for (int k = 0; k < 6; k++) question.wrench[k] = (fl_real)wrench[k];
  if (previous) {{
    for (int i = 0; i < ROBOT_COUNT; i++)
      for (int k = 0; k < 3; k++) before[i][k] = (fl_real)previous[i][k];
    question.previous = before[0];
  }}
  const int code = robot_answer(&work, &question, &answer);
  if (code) return code;
  for (int i = 0; i < ROBOT_COUNT; i++)
    for (int k = 0; k < 3; k++) command[i][k] = (double)answer.command[i][k];
{over_budget}  return FL_OK;
}}
"""
_OVER_BUDGET = "  if (answer.exceeds_budget) return FL_OVER_BUDGET;\n"


def _header(layout: Layout, name: str) -> str:
    coupled = DECLARATIONS_WITHOUT
    if layout.interaction is not None:
        coupled = DECLARATIONS.format(name=name)
    rows = _rows_of_commands(layout, "ROBOT")
    budget = _WITHOUT_BUDGET if budget_of(layout) is None else _BUDGET.format(name=name)
    return _HEADER.format(title=layout.name, name=name, rows=rows, coupled=coupled, budget=budget)


def _plain_header(layout: Layout, name: str) -> str:
    rows = _rows_of_commands(layout, f"FL_{name.upper()}")
    upper = name.upper()
    but = ""
    budget = ""
    if budget_of(layout) is not None:
        but = f", but for FL_{upper}_OVER_BUDGET"
        budget = _PLAIN_BUDGET.format(upper=upper, code=constant("FL_OVER_BUDGET"))
    return _PLAIN_HEADER.format(
        title=layout.name, name=name, upper=upper, rows=rows, but=but, budget=budget
    )


def _plain_source(layout: Layout, name: str) -> str:
    over_budget = "" if budget_of(layout) is None else _OVER_BUDGET
    return _PLAIN_SOURCE.format(name=name, calm=DualSettings().calm, over_budget=over_budget)


def _core_command(method: Dual, wrench: Array, policy: Policy) -> Array:
    """Commands (1, n, 3) for a wrench (6,) as the core gives them."""
    if method.plant.interaction is None:
        budget = budget_of(method.layout)
        conditions = Conditions(budget=None if budget is None else budget.record)
        return method.compiled.forces(wrench[None], policy, None, conditions).command
    return method.coupled.answer_many(wrench[None], core_policy(policy)).command


def _self_test(layout: Layout, method: Dual, count: int) -> str:
    """The questions of the self-test with their answers: wrenches within reach, out of reach by
    each policy, and ticks.

    Questions where the library refines the core's commands are left out: the export has no such
    step.
    """
    allocator = Allocator(layout)
    flow = method.plant.flow
    rng = np.random.default_rng(0)
    previous_rows: list[str] = []
    rows: list[str] = []
    questions = [each for each in QUESTIONS if budget_of(layout) is None or each[0] != "falling"]
    for k in range(8 * count):
        if len(rows) == count:
            break
        policy, reach = questions[k % len(questions)]
        given = method.plant.wrench(method.plant.sample(rng, (1,)))[0] * layout.commanded
        asked = askable(reach * given)
        tick = None
        if reach < 0.9:
            tick = allocator.allocate(askable(0.5 * given), flow=flow).command
        answer = allocator.allocate(asked, policy=policy, previous=tick, flow=flow)
        delivered = answer.wrench * layout.commanded
        core_command = _core_command(method, asked, Policy(policy))
        core_error = method.problem.error(core_command, delivered[None] / method.scale)[0]
        if tick is None and core_error > MAX_CORE_ERROR:
            continue
        error, previous = (0.0, "0") if tick is None else (answer.err_norm, f"previous_{k}")
        if tick is not None:
            previous_rows.append(f"static const fl_real {previous}[][3] = {_rows(tick)};")
        answered = f"{_row(delivered)}, {error!r}, {_rows(answer.command)}"
        rows.append(f"  {{FL_{policy.upper()}, {_row(asked)}, {answered}, {previous}}},")
    calm = method.settings.calm
    counts = f"#define CALM {calm!r}\nenum {{ SAMPLES = {len(rows)} }};"
    return "\n".join([*previous_rows, "static const sample samples[] = {", *rows, "};", counts, ""])
