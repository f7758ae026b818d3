"""The functions that the core's files share, called one by one, and robots of which to ask them.

The library exports them without promising them (`finlab/core/src/internal.h`), so what stands here
is for tests alone. Structs are read from the headers: a field more changes nothing."""

import ctypes
import math
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from finlab import core
from finlab.actuators.thrust_model import PowerLaw
from finlab.allocation import Allocator
from finlab.arrays import Array
from finlab.core import PATH, library
from finlab.core.fields import Record, actuators_of, constant, head_of, struct
from finlab.layout import Azimuth, Layout
from finlab.layout.load import parse_layout
from finlab.physics.plant import Plant
from tests.random_robots import KINDS, random_flow, random_robot, with_dead_bands, with_rates

CORE_FOLDER = Path(core.__path__[0])
"""Where the headers stand."""
REAL = ctypes.c_double
"""`fl_real` and `fl_wide` of the library in this package."""
MOST = constant("FL_MOST")
"""Most actuators of a robot."""
ARCS = constant("FL_ARCS")
"""Most foils that may stall beyond reach."""
FIN = constant("FL_FIN")
"""Form of a fin's command, FL_FIN."""
POD = constant("FL_POD")
"""Form of a pod's command, FL_POD."""
STEERED = constant("FL_STEERED")
"""Form of the command of a propeller with a rudder, FL_STEERED."""


def _macro(name: str) -> int:
    """A number that `fl_work.h` defines: those of work areas the library does not tell."""
    text = (CORE_FOLDER / "fl_work.h").read_text(encoding="utf-8")
    found = re.search(rf"^#define {name} (\d+)\b", text, re.MULTILINE)
    assert found is not None, name
    return int(found[1])


POINTS = _macro("FL_POINTS")
"""Most points of a mixture."""
_DEPTH = 16 + MOST
"""FL_DEPTH_OF(FL_MOST), a formula and no number in `fl_work.h`."""
_LENGTHS = {
    "FL_MOST": MOST,
    "FL_LINES": MOST,
    "FL_POINTS": POINTS,
    "FL_SCORES": _macro("FL_SCORES"),
    "FL_DEPTH": _DEPTH,
    "FL_BUSES": constant("FL_BUSES"),
    "FL_BUDGET_TARGETS": _macro("FL_BUDGET_TARGETS"),
}
"""Lengths of arrays in the headers that are macros."""
_KINDS: dict[str, Any] = {
    "fl_real": REAL,
    "fl_wide": REAL,
    "int": ctypes.c_int,
    "unsigned char": ctypes.c_ubyte,
    "signed char": ctypes.c_byte,
}
"""Types of fields in the headers; structs join them below, each once it is read."""
_MEMBER = re.compile(r"\s*(\*?)(\w+)((?:\[\w+\])*)\s*")
"""A field: whether it is a pointer, its name, its lengths."""


def _fields(declarations: str) -> list[tuple[str, Any]]:
    """Fields that a header declares, such as `fl_real force[FL_MOST][2];`."""
    fields = list[tuple[str, Any]]()
    for declaration in re.sub(r"/\*.*?\*/", "", declarations, flags=re.S).split(";")[:-1]:
        words = declaration.split()
        kind = words[0]
        if kind in ("signed", "unsigned"):
            kind = f"{kind} char"
        if words[0] == "const":
            kind = words[1]
        names = declaration.partition(kind)[2]
        for member in names.split(","):
            match = _MEMBER.fullmatch(member)
            assert match is not None, declaration
            is_pointer, name, lengths = match.groups()
            field_type = ctypes.c_void_p if is_pointer else _KINDS[kind]
            for length in reversed(re.findall(r"\w+", lengths)):
                field_type = field_type * (_LENGTHS[length] if length in _LENGTHS else int(length))
            fields.append((name, field_type))
    return fields


def _members(header: str, name: str) -> list[tuple[str, Any]]:
    """Fields of a struct that a header defines, such as `typedef struct { ... } fl_set;`."""
    text = (CORE_FOLDER / header).read_text(encoding="utf-8")
    return _fields(text[: text.index(f"}} {name};")].rpartition("typedef struct {")[2])


class Set(ctypes.Structure):
    """What one actuator may give: `fl_set`."""

    _fields_ = _members("fl_work.h", "fl_set")


class Span(ctypes.Structure):
    """What the actuators span: `fl_span`."""

    _fields_ = _members("fl_work.h", "fl_span")


class Tangent(ctypes.Structure):
    """A foil near to a command: `fl_tangent`."""

    _fields_ = _members("fl_work.h", "fl_tangent")


class State(ctypes.Structure):
    """Multipliers and what they give: `fl_state`."""

    _fields_ = _members("fl_work.h", "fl_state")


class Mixture(ctypes.Structure):
    """Points whose mixture comes near to a point out of reach: `fl_mixture`."""

    _fields_ = _members("fl_work.h", "fl_mixture")


class Box(ctypes.Structure):
    """Commands that are allowed: `fl_box`."""

    _fields_ = _members("fl_work.h", "fl_box")


class PriceTable(ctypes.Structure):
    """A table of force over price: `fl_price_table`."""

    _fields_ = _members("fl_work.h", "fl_price_table")


class BudgetBegin(ctypes.Structure):
    """Multipliers at which a target within budgets begins: `fl_budget_begin`."""

    _fields_ = _members("fl_work.h", "fl_budget_begin")


_KINDS["fl_budget_begin"] = BudgetBegin
_KINDS["fl_law_power"] = ctypes.c_void_p
_KINDS["fl_set"] = Set
_KINDS["fl_price_table"] = PriceTable


class Line(ctypes.Structure):
    """An actuator that pushes along one direction: `fl_line`."""

    _fields_ = _members("fl_work.h", "fl_line")


class Cut(ctypes.Structure):
    """A cut on the way to a part of sets with gaps: `fl_cut`."""

    _fields_ = _members("fl_work.h", "fl_cut")


_KINDS |= {
    "fl_cut": Cut,
    "fl_line": Line,
    "fl_mixture": Mixture,
    "fl_tangent": Tangent,
    "fl_span": Span,
    "fl_box": Box,
    "fl_state": State,
    "fl_settings": ctypes.c_int * (struct("fl_settings").itemsize // 4),
}


def _work_until(last: str) -> list[tuple[str, Any]]:
    """Fields of the work area, `fl_work`, from the first one to a last one."""
    text = (CORE_FOLDER / "fl_work.h").read_text(encoding="utf-8")
    fields = text.partition("struct fl_work {")[2]
    end = re.search(rf"\b{last}\b[^;]*;", fields)
    assert end is not None
    return _fields(fields[: end.end()])


class Work(ctypes.Structure):
    """The work area up to the multipliers at which a tick begins."""

    _fields_ = _work_until("has_lambda_begin")


class Response(ctypes.Structure):
    """The answer to a price: `response`."""

    _fields_ = [
        ("force", REAL * 2),
        *((name, REAL) for name in ("xx", "xy", "yy", "conjugate", "angle")),
    ]


class LineResponse(ctypes.Structure):
    """The answer along one direction: `line_response`."""

    _fields_ = [(name, REAL) for name in ("force", "slope", "conjugate")]


class GaugePoint(ctypes.Structure):
    """A support function: `gauge_point`."""

    _fields_ = [(name, REAL) for name in ("value", "slope", "bend")]


class ForceRange(ctypes.Structure):
    """What commands within a box give: `force_range`."""

    _fields_ = [(name, REAL) for name in ("low", "high", "middle", "half")]


class CommandForm(ctypes.Structure):
    """What the numbers of a command are: `command_form`."""

    _fields_ = _members("src/internal.h", "command_form")


@cache
def functions() -> ctypes.PyDLL:
    """The library once more, with what its internal functions return."""
    assert library()
    loaded = ctypes.PyDLL(str(PATH))
    returns: dict[str, Any] = {
        "fl_response": Response,
        "fl_response_with_turning": Response,
        "fl_force_of_price": LineResponse,
        "fl_limited_response": LineResponse,
        "fl_gauge_support": GaugePoint,
        "fl_steered_support": GaugePoint,
        "fl_force_range": ForceRange,
        "fl_form_of": ctypes.POINTER(CommandForm),
        **dict.fromkeys(
            (
                *(
                    "fl_power_of_force",
                    "fl_power_and_price",
                    "fl_marginal_cost",
                    "fl_support_of_set",
                ),
                *("fl_gauge_radius", "fl_gauge_lean", "fl_largest_slope", "fl_refine_commands"),
                *("fl_drag_of_lift", "fl_dual_value", "fl_error_allowed", "fl_meet_and_cheapen"),
                *("fl_nearest_point", "fl_farthest_along_ray", "fl_radius"),
                *("fl_steered_deflection", "fl_steered_radius"),
            ),
            REAL,
        ),
    }
    for name, kind in returns.items():
        getattr(loaded, name).restype = kind
    return loaded


def at(values: Array) -> ctypes.c_void_p:
    """Where an array of numbers lies."""
    assert values.dtype == np.float64 and values.flags["C_CONTIGUOUS"]
    return ctypes.c_void_p(values.ctypes.data)


def prepared_work(block: Array) -> Any:
    """A work area that is prepared for a robot's block."""
    work = ctypes.create_string_buffer(constant("sizeof fl_work"))
    assert functions().fl_prepare(at(block), work) == 0
    return work


def dual_function(block: Array, wrench: Array, lambda_reduced: Array) -> tuple[Array, float]:
    """Responses (n, 2) [N] (Eq. 5) and the dual value [W] (Eq. 3) of a robot that is whole, for a
    wrench (6,) [N, N m] at multipliers (6,) [W] in the basis of what its actuators span."""
    force = np.zeros((len(actuators_of(block)), 2))
    value = functions().fl_dual_value(
        at(block), prepared_work(block), at(wrench), at(lambda_reduced), at(force)
    )
    return force, float(value)


@dataclass(frozen=True)
class Robot:
    """A robot in the core, and what judges it."""

    layout: Layout
    plant: Plant
    """In the flow of the block."""
    block: Array
    axes: Array
    """Axes (n, 3, 3) of the laws' forces in the actuators' own ones, in rows."""

    @property
    def n(self) -> int:
        """How many actuators it has."""
        return self.layout.n

    @property
    def head(self) -> Record:
        """Fields of the whole robot."""
        return head_of(self.block)

    @property
    def actuators(self) -> Record:
        """Fields of each actuator (n,)."""
        return actuators_of(self.block)

    def table(self, offset: float) -> Array:
        """The numbers of the block from an offset on."""
        return self.block[int(offset) :]

    def is_plane(self, i: int) -> bool:
        """Whether an actuator pushes in a plane."""
        actuator = self.actuators[i]
        return bool(actuator["rows"] == 2.0 and actuator["flow_speed"] == 0.0)

    def work(self) -> Any:
        """A work area that is prepared."""
        return prepared_work(self.block)

    def whole_box(self) -> Box:
        """The limits of all commands."""
        box = Box()
        for i, actuator in enumerate(self.actuators):
            box.command_min[i][:] = actuator["command_min"]
            box.command_max[i][:] = actuator["command_max"]
            box.is_free_angle[i] = int(actuator["is_free_angle"] != 0.0)
        return box

    def set_of(self, i: int, low: float, high: float, middle: float, half: float) -> Set:
        """A set between two forces [N], in an arc [rad]."""
        made = Set()
        limits = (REAL(low), REAL(high), REAL(middle), REAL(half))
        functions().fl_limit_set(at(self.block), i, ctypes.byref(made), *limits)
        return made

    def whole_set(self, i: int) -> Set:
        """All that an actuator may give."""
        actuator = self.actuators[i]
        return self.set_of(
            i,
            actuator["force_min"],
            actuator["force_max"],
            actuator["sector_center"],
            actuator["sector_half_angle"],
        )

    def power(self, i: int, force: float) -> float:
        """Power [W] of a size of force [N], of planes below 0 in reverse."""
        return float(functions().fl_power_of_force(at(self.block), i, REAL(force)))

    def drag(self, i: int, lift: float) -> float:
        """Drag [N], beyond that at rest, of a foil's lift [N]; 0 of all else."""
        return float(functions().fl_drag_of_lift(at(self.block), i, REAL(lift)))

    def radius(self, i: int, angle: float) -> float:
        """Share of the table's force in a direction [rad]."""
        return float(functions().fl_radius(at(self.block), i, REAL(angle)))

    def force(self, i: int, command: Array) -> tuple[Array, Array]:
        """Force (3,) of a command (3,) along the law's axes, and its derivatives (3 commands, 3
        axes)."""
        force = np.zeros(3)
        slope = np.zeros((3, 3))
        functions().fl_force_of_command(at(self.block), i, at(command), at(force), at(slope))
        return force, slope

    def response(self, i: int, limits: Set, price: Array) -> Response:
        """The answer of an actuator to prices (2,) along its rows."""
        response: Response = functions().fl_response(
            at(self.block), i, ctypes.byref(limits), at(price)
        )
        return response

    def answer(self, wrench: Array, **fields: Any) -> Record:
        """The answer to a wrench (6,), with other fields of the question."""
        question, _kept = question_of(wrench, fields)
        answer = np.zeros(1, struct("fl_answer"))
        places = ctypes.c_void_p(question.ctypes.data), ctypes.c_void_p(answer.ctypes.data)
        assert functions().fl_answer_one(at(self.block), self.work(), *places) == 0
        return answer[0]

    def sets_now(self, **fields: Any) -> list[Set]:
        """What each actuator may give in a question, by its fields."""
        question, _kept = question_of(np.zeros(6), fields)
        work = self.work()
        question_address = ctypes.c_void_p(question.ctypes.data)
        assert functions().fl_prepare_question(at(self.block), work, question_address)
        return [Set.from_buffer_copy(limits) for limits in Work.from_buffer(work).set[: self.n]]


def question_of(wrench: Array, fields: dict[str, Any]) -> tuple[Record, list[Any]]:
    """A question as the core reads it, and the arrays at which it points."""
    question = np.zeros(1, struct("fl_question"))
    question["wrench"] = wrench
    arrays = list[Any]()
    for name, value in fields.items():
        if isinstance(value, np.ndarray):
            arrays.append(np.ascontiguousarray(value))
            value = arrays[-1].ctypes.data
        question[name] = value
    return question, arrays


def in_the_core(layout: Layout, flow: Array | None = None) -> Robot:
    """A robot of the default method, in a flow."""
    method = Allocator(layout)._whole.method.at(flow)  # type: ignore[attr-defined]
    compiled = method.compiled
    return Robot(layout, method.plant, compiled.block.copy(), compiled.axes)


def pods_either_way(seed: int) -> Layout:
    """Pods that push either way, in arcs of any width, some with a dead band."""
    rng = np.random.default_rng(seed)
    pods = []
    for k, half in enumerate((0.15, 0.8, 2.2, math.pi)):
        force_max = rng.uniform(20.0, 60.0)
        middle = rng.uniform(-3.0, 3.0) if half == 0.15 else rng.uniform(-0.5, 0.5)
        arc = (-math.pi, math.pi) if half == math.pi else (middle - half, middle + half)
        ends = (-rng.uniform(0.3, 1.3) * force_max, force_max)
        pods.append(
            Azimuth(
                f"p{k}",
                tuple(rng.uniform(-0.5, 0.5, 3)),
                (0.0, 0.0, 1.0),
                (1.0, 0.0, 0.0),
                ends,
                PowerLaw(0.3, 0.3 * rng.uniform(0.7, 2.0), float(rng.choice([1.5, 1.8]))),
                arc,
                dead_band=float(rng.choice([0.0, 3.0])),
                rate=float(2.0 * force_max),
                turn_rate=1.0,
            )
        )
    return Layout("pods", tuple(pods))


EITHER_WAY = "pods either way"
"""Name of the robots whose pods push either way."""
ROBOTS = (*KINDS, EITHER_WAY)
"""Names of robots: kinds, and pods that push either way."""


@cache
def robot_of(name: str, number: int = 0, seed: int = 71) -> Robot:
    """A robot by its name, with dead bands and rates where a kind has them."""
    if name == EITHER_WAY:
        return in_the_core(pods_either_way(seed + number))
    rng = np.random.default_rng([seed, number])
    mapping = with_dead_bands(with_rates(random_robot(name, number, seed)), rng)
    return in_the_core(parse_layout(mapping), random_flow(name, number, seed))
