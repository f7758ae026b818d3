"""Responses two at a time, and sums of squares written out, give what the code beside them does:
responses one by one, and the library as compilers without vectors have it."""

import ctypes
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finlab import core
from finlab.allocation.dual.compiled import Compiled, core_policy
from finlab.allocation.policy import POLICY_NAMES, as_policy
from finlab.arrays import Array
from finlab.core import SIGNATURES, library
from finlab.core.calls import NOMINAL, ROWS, AnswerMemory, QuestionRecord, prepared_work
from finlab.core.fields import constant, head_of
from finlab.layout import load_layout
from tests.core.internal_functions import ROBOTS, Robot, dual_function, in_the_core, robot_of

CORE_FOLDER = Path(core.__path__[0])
"""The core's headers and sources."""
SHIPPED = ("bluerov2_heavy", "bluerov2", "turtle_hybrid", "catamaran", "A")
"""Shipped robots: thrusters with a power law and with tables, fins, pods."""


def robots() -> list[Robot]:
    """Random robots of all kinds, and shipped ones."""
    return [*map(robot_of, ROBOTS), *(in_the_core(load_layout(name)) for name in SHIPPED)]


@pytest.mark.parametrize("robot", robots(), ids=(*ROBOTS, *SHIPPED))
def test_forces_and_dual_value_are_those_of_single_responses(robot: Robot) -> None:
    rng = np.random.default_rng(59)
    columns = robot.actuators["effectiveness_reduced"]
    sets = robot.sets_now()
    most = robot.actuators["force_max"]
    for size in np.geomspace(1e-6, 1e6, 13):
        reduced = size * rng.normal(size=6)
        force, value = dual_function(robot.block, np.zeros(6), reduced)
        conjugates = 0.0
        for i in range(robot.n):
            price = np.ascontiguousarray(columns[i] @ reduced)
            response = robot.response(i, sets[i], price)
            expected = np.array(response.force)
            assert force[i] == pytest.approx(expected, rel=1e-9, abs=1e-9 * most[i])
            conjugates += response.conjugate
        assert value == pytest.approx(-conjugates, rel=1e-9, abs=1e-12)


@pytest.fixture(scope="module")
def without_pairs(tmp_path_factory: pytest.TempPathFactory) -> ctypes.PyDLL:
    """The library as compilers without vectors have it."""
    made = tmp_path_factory.mktemp("core") / "libfinlab_without_pairs.so"
    sources = map(str, sorted(CORE_FOLDER.glob("src/*.c")))
    flags = ["-std=c99", "-O1", "-ffp-contract=off", "-fPIC", "-shared", "-DFL_WITH_FALLING"]
    words = ["cc", *flags, "-DFL_NO_PAIRS", f"-I{CORE_FOLDER}", *sources, "-o", str(made), "-lm"]
    subprocess.run(words, check=True)
    loaded = ctypes.PyDLL(str(made))
    kinds = {"i": ctypes.c_int, "r": ctypes.c_double, "p": ctypes.c_void_p}
    signature = SIGNATURES["fl_answer_into_row"]
    loaded.fl_answer_into_row.argtypes = [kinds[letter] for letter in signature[1:]]
    return loaded


def _commands_by(loaded: Any, robot: str, wrenches: Array, policy: Any) -> tuple[Array, Array]:
    """Commands (N, n, 3) of a robot by a library, and the wrenches (N, 6) that it serves, over the
    wrench scale."""
    compiled = Compiled.of(load_layout(robot))
    work = prepared_work(compiled.block)
    assert loaded.fl_prepare(ctypes.c_void_p(compiled.block.ctypes.data), work) == 0
    commands = []
    served = []
    asked = core_policy(policy)
    for wrench in wrenches:
        question = QuestionRecord(compiled.count)
        question.write_wrench(wrench)
        question.write(asked, None, NOMINAL)
        memory = AnswerMemory(compiled.count)
        addresses = compiled.block.ctypes.data, ctypes.addressof(work), question.address
        code = loaded.fl_answer_into_row(*addresses, 1e-6, memory.address_of(ROWS - 1))
        assert code in (0, constant("FL_UNFINISHED"), constant("FL_BEYOND_REACH"))
        commands.append(memory.command[ROWS - 1].copy())
        served.append(
            memory.head["wrench_served"][ROWS - 1] / head_of(compiled.block)["wrench_scale"]
        )
    return np.array(commands), np.array(served)


@pytest.mark.parametrize("policy", POLICY_NAMES)
@pytest.mark.parametrize("robot", SHIPPED)
def test_answers_are_those_of_a_library_without_pairs(
    without_pairs: ctypes.PyDLL, robot: str, policy: Any
) -> None:
    layout = load_layout(robot)
    rng = np.random.default_rng(59)
    sizes = np.geomspace(0.5, 200.0, 10)[:, None]
    wrenches = sizes * rng.normal(size=(10, 6)) * layout.commanded
    asked = as_policy(policy)
    own, served = _commands_by(library(), robot, wrenches, asked)
    others, others_served = _commands_by(without_pairs, robot, wrenches, asked)
    assert np.isfinite(own).all()
    # Beyond reach prices are steep: wrenches are as near as `priority` is exact, commands not.
    assert served == pytest.approx(others_served, abs=1e-5)
    is_met = np.abs(served * scale_of(robot) - wrenches).max(axis=1) <= 1e-9
    assert is_met.any()
    assert own[is_met] == pytest.approx(others[is_met], rel=1e-6, abs=1e-6)


def scale_of(robot: str) -> Array:
    """Wrench scale (6,) of a shipped robot [N, N m]."""
    return np.asarray(in_the_core(load_layout(robot)).head["wrench_scale"])
