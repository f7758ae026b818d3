"""`finlab export ROBOT --c DIR`: the self-test here, under sanitizers, on aarch64 and on a
Cortex-M7."""

import ctypes
import os
import re
import shlex
import shutil
import subprocess
from dataclasses import replace
from functools import cache
from itertools import starmap
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest

from finlab import Allocator
from finlab.allocation.question import MAX_WRENCH
from finlab.cli import main
from finlab.core.fields import actuators_of, constant
from finlab.deploy.bundle import make_bundle
from finlab.deploy.c_sources import c_sources, write_c
from finlab.deploy.deployed_robot import extremes, parse_robot, self_check
from finlab.deploy.thin_block import tables_of, thinned
from finlab.errors import AllocationError
from finlab.layout import load_layout
from finlab.layout.layout import Bus, Layout
from finlab.physics import plant_of
from tests.allocator_cache import AllocatorCache
from tests.core.test_foil_arcs import beyond, tail
from tests.random_robots import KINDS, load, random_flow, random_robot, with_rates
from tests.sampled_cases import sampled
from tests.terminal import refused

HERE = Path(__file__).parent
"""Folder of the programs in C that are linked with an export."""
PRECISIONS = "", "-DFL_SINGLE"
"""Options of the compiler for double and for single precision."""
SANITIZERS = "-g -fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all"
"""Options of the compiler that end a program at what C does not define."""
CORTEX_M7 = (
    "-mcpu=cortex-m7 -mthumb -mfpu=fpv5-sp-d16 -mfloat-abi=hard -ffp-contract=off -fno-math-errno"
)
"""Options of the compiler for a Cortex-M7 with a unit for single precision."""
M7_COMPILER = f"arm-none-eabi-gcc -std=c99 -Os {CORTEX_M7} -ffunction-sections -fdata-sections"
"""The cross compiler, for small code."""


POLICIES = {
    policy: constant(f"FL_{policy.upper()}") for policy in ("closest", "direction", "priority")
}
"""Numbers of policies in C."""
SPEED = 2.5, 0.2, -0.1, 0.0, 0.05, 0.1
"""A velocity through the water [m/s, rad/s]."""
EXPORTS = ("octo", None), ("A", None), ("torpedo", SPEED), ("bluerov2", None), ("torpedo", None)
"""Robots that are exported, and the flow in which each is [m/s, rad/s]."""


@cache
def _exported(name: str, samples: int, flow: tuple[float, ...] | None) -> TemporaryDirectory[str]:
    """An export in a folder that goes when the last test is done."""
    folder = TemporaryDirectory()
    write_c(c_sources(load_layout(name), samples, flow), folder.name)
    return folder


def exported(name: str, samples: int = 24, flow: tuple[float, ...] | None = None) -> Path:
    """The folder of an export of a shipped robot, with `samples` questions of its self-test."""
    return Path(_exported(name, samples, flow).name)


def ran(command: str, folder: Path, code: int = 0) -> str:
    """What a command prints, run in a folder; `*` stands for names. Compilers that are missing fail
    the test: `make test` installs them."""
    done = subprocess.run(
        command, shell=True, cwd=folder, capture_output=True, text=True, timeout=7200
    )
    assert done.returncode == code, f"{command}\n{done.stdout[-2000:]}{done.stderr[-2000:]}"
    return done.stdout


@pytest.mark.parametrize("compiler", ["gcc", "clang -DFL_SINGLE"])
@pytest.mark.parametrize(("name", "flow"), sampled(starmap(pytest.param, EXPORTS), every=2))
def test_self_test_holds(
    name: str, flow: tuple[float, ...] | None, compiler: str, tmp_path: Path
) -> None:
    words = (
        f"{compiler} -std=c99 -O0 -Wall -Wextra -Werror *.c -lm -o {tmp_path}/it && {tmp_path}/it"
    )
    assert ran(words, exported(name, 200, flow)).startswith("0 of 200 ")


@pytest.mark.parametrize("single", ["", "-DFL_SINGLE"])
@pytest.mark.parametrize("name", ["bluerov2", "A"])
def test_policy_falling_is_compiled_by_a_macro(name: str, single: str, tmp_path: Path) -> None:
    """Its questions are in every self-test; without the macro they have to be refused."""
    words = f"gcc -std=c99 -O1 {single} -DFL_WITH_FALLING *.c -lm -o {tmp_path}/it"
    assert ran(f"{words} && {tmp_path}/it", exported(name, 200)).startswith("0 of 200 ")


@pytest.mark.exhaustive
def test_single_precision_chooses_the_same_parts_of_sets_with_gaps(tmp_path: Path) -> None:
    """Of parts that all give a wrench, the miss is rounding, which is to choose no side."""
    words = f"gcc -std=c99 -O0 -DFL_SINGLE *.c -lm -o {tmp_path}/it && {tmp_path}/it"
    assert ran(words, exported("torpedo", 2000, SPEED)).startswith("0 of 2000 ")


def test_single_precision_goes_on_while_the_ridge_grows(tmp_path: Path) -> None:
    """From the first prices of foils at a kink, eight steps in a row are refused."""
    words = f"gcc -std=c99 -O0 -DFL_SINGLE *.c -lm -o {tmp_path}/it && {tmp_path}/it"
    assert ran(words, exported("torpedo", 24, (1.5, 0.0, 0.0, 0.0, 0.0, 0.0))).startswith(
        "0 of 24 "
    )


@pytest.mark.parametrize("single", PRECISIONS)
def test_self_test_fails_where_a_number_is_another(single: str, tmp_path: Path) -> None:
    other = shutil.copytree(exported("octo", 200), tmp_path / "c")
    part = "FL_SINGLE\n" if single else "#else\n"
    first, rest = (other / "robot.c").read_text().split(part)
    numbers = rest.split(", ")  # the sixth is the scale of forces along x
    numbers[5] = str(1.5 * float(numbers[5]))
    (other / "robot.c").write_text(part.join([first, ", ".join(numbers)]))
    ran(f"gcc -std=c99 {single} *.c -lm && ./a.out", other, 1)


@pytest.mark.exhaustive
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_self_test_holds_on_any_robot(kind: str, seed: int, tmp_path: Path) -> None:
    write_c(c_sources(load(with_rates(random_robot(kind, 4, 60 + seed))), 40), tmp_path)
    for single in PRECISIONS:
        ran(f"gcc -std=c99 -O1 {single} *.c -lm && ./a.out", tmp_path)


@pytest.mark.parametrize(("number", "seed"), [(1, 61), (0, 8)])
def test_self_test_of_rudders_in_slipstreams_holds(number: int, seed: int, tmp_path: Path) -> None:
    """In a flow, where the slipstream is never without force, and at rest, where an arc ends beside
    what is pushed astern."""
    layout = load(random_robot("slipstreams", number, seed))
    write_c(c_sources(layout, flow=random_flow("slipstreams", number, seed)), tmp_path)
    for single in PRECISIONS:
        ran(f"gcc -std=c99 -O0 {single} *.c -lm && ./a.out", tmp_path)


@pytest.mark.parametrize("name", ["supply", "drillship"])
def test_self_test_of_a_ship_holds(name: str) -> None:
    """Its forces are a million times those of a small robot; so in single precision, too."""
    folder = exported(name, 40)
    for single in PRECISIONS:
        assert ran(f"gcc -std=c99 -O1 {single} *.c -lm && ./a.out", folder).startswith("0 of 40 ")


def test_what_the_largest_robot_gives_and_nobody_may_ask_is_not_asked(tmp_path: Path) -> None:
    """Its torque is beyond the largest wrench of a question."""
    force_n = [-1e9, 1e9]
    model = {"type": "power_law", "forward": 0.01, "reverse": 0.01}
    actuators = []
    for name, x in (("aft", -1000.0), ("fore", 1000.0)):
        place = {"position_m": [x, 0.0, 0.0], "axis": [0, 1, 0], "force_n": force_n}
        actuators.append({"name": name, "type": "thruster", "model": model, **place})
    layout = load(
        {"format": "finlab-layout", "version": 2, "name": "largest", "actuators": actuators}
    )
    turning = np.array([[-1e9, 0.0, 0.0], [1e9, 0.0, 0.0]])
    assert plant_of(layout).wrench(turning[None])[0, 5] == pytest.approx(2.0 * MAX_WRENCH)
    write_c(c_sources(layout), tmp_path / "c")
    for single in PRECISIONS:
        done = ran(f"gcc -std=c99 -O1 {single} *.c -lm && ./a.out", tmp_path / "c")
        assert done.startswith("0 of 24 ")
    robot = parse_robot(make_bundle(Allocator(layout)).files)
    assert all(finding.good for finding in (*self_check(robot), extremes(robot)))


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", ["A", "bluerov2_heavy", "turtle_hybrid", "mixed", "restricted"])
def test_single_precision_answers_as_double_does(name: str, tmp_path: Path) -> None:
    words = f"gcc -std=c99 -O2 -DFL_SINGLE *.c -lm -o {tmp_path}/it && {tmp_path}/it"
    assert ran(words, exported(name, 2000)).startswith("0 of 2000 ")


@pytest.mark.parametrize(
    ("name", "cases", "compiler"),
    [
        ("catamaran", 1500, "gcc"),
        ("torpedo", 600, "clang -DFL_SINGLE"),
        pytest.param("catamaran", 12000, "gcc", marks=pytest.mark.exhaustive),
        pytest.param("torpedo", 3000, "clang -DFL_SINGLE", marks=pytest.mark.exhaustive),
        pytest.param("octo", 1000, "clang", marks=pytest.mark.exhaustive),
        pytest.param("mixed", 1000, "gcc -DFL_SINGLE", marks=pytest.mark.exhaustive),
    ],
)
def test_fuzzer_finds_nothing(name: str, cases: int, compiler: str, tmp_path: Path) -> None:
    cases = int(os.environ.get("FUZZ", cases))  # `make fuzz`: a million in all
    words = (
        f"{compiler} -std=c99 -O1 {SANITIZERS} -DFL_NO_MAIN -DFL_PARTS=20 -I. *.c {HERE / 'fuzz.c'}"
    )
    folder = exported(name, flow=SPEED if name == "torpedo" else None)
    said = ran(f"{words} -lm -o {tmp_path}/it && {tmp_path}/it {cases}", folder)
    blocks, refused_ones, answers = map(int, re.findall(r"\d+", said)[:3])
    assert blocks == cases and 0 < refused_ones < blocks / 2 and answers > blocks


@pytest.mark.parametrize(("number", "foils"), [(0, 3), (1, 4)])
def test_stalled_foils_in_a_flow_are_answered_as_in_python(
    number: int, foils: int, tmp_path: Path
) -> None:
    """Within reach and beyond it, where foils stall."""
    robot, flow = tail(number, foils)
    folder = tmp_path / "c"
    write_c(c_sources(robot.layout, 40, flow), str(folder))
    built = f"gcc -std=c99 -O1 -Wall -Wextra -Werror {SANITIZERS}"
    assert ran(f"{built} *.c -lm -o {tmp_path}/it && {tmp_path}/it", folder).startswith("0 of 40 ")

    allocator = Allocator(robot.layout)
    wrenches = [*beyond(robot, number), *beyond(robot, number) / 3.0]
    asked = [(policy, wrench) for policy in POLICIES for wrench in wrenches]
    lines = [
        f"{POLICIES[policy]} {' '.join(map(repr, wrench.tolist()))}" for policy, wrench in asked
    ]
    questions = tmp_path / "questions"
    questions.write_text("\n".join(lines))
    words = f"{built} -DFL_NO_MAIN -I. *.c {HERE / 'answers.c'} -lm -o {tmp_path}/answers"
    said = ran(f"{words} && {tmp_path}/answers < {questions}", folder)
    command = np.array(said.split(), float).reshape(len(asked), robot.n, 3)
    stalled = 0
    for (policy, wrench), own in zip(asked, command, strict=True):
        answer = allocator.allocate(wrench, policy=policy, flow=flow)
        given = robot.plant.wrench(own)
        size = np.linalg.norm(wrench / allocator.scale)
        off = np.linalg.norm((given - robot.plant.wrench(answer.command)) / allocator.scale)
        # An export goes by the grids of the laws, which are within FINE of them; Python's last steps
        # go by the laws.
        assert off <= 1e-5 * size
        assert robot.plant.power(own).sum() == pytest.approx(answer.power, rel=1e-4)
        angles = np.abs(own[-foils:, 0])
        stalled += bool((angles > [part.stall for part in robot.layout.actuators[-foils:]]).any())
    assert stalled >= 3


def test_on_aarch64(tmp_path: Path) -> None:
    for single in PRECISIONS:
        words = f"aarch64-linux-gnu-gcc -std=c99 -O2 -static {single} *.c -lm -o {tmp_path / 'it'}"
        assert ran(f"{words} && qemu-aarch64 {tmp_path / 'it'}", exported("octo", 200)).startswith(
            "0 of "
        )


def test_on_a_cortex_m7_in_its_memory(tmp_path: Path) -> None:
    folder = exported("octo", 2000)
    elf = tmp_path / "it.elf"
    board = f"-Wl,--gc-sections -nostartfiles -T{HERE / 'board.ld'} {HERE / 'board.c'}"
    ran(f"{M7_COMPILER} -DFL_NO_MAIN {board} -I. *.c -lm -o {elf}", folder)
    machine = (
        "-M mps2-an500 -display none -monitor none -serial stdio -semihosting-config "
        "enable=on,target=native"
    )
    said = ran(f"qemu-system-arm {machine} -kernel {elf}", folder)
    found = {name: int(value) for name, value in re.findall(r"(\w+) (\d+)", said)}
    assert found["differ"] == 0
    assert found["static"] + found["stack"] <= 17_000, "bytes"
    core = [
        path.stem
        for path in folder.glob("*.c")
        if path.stem not in ("robot", "allocate", "selftest")
    ]
    for name in core:
        ran(f"{M7_COMPILER} -c {name}.c -o {tmp_path / name}.o", folder)
    sizes = ran(f"arm-none-eabi-size {shlex.join(f'{name}.o' for name in core)}", tmp_path)
    assert 16_000 < sum(int(line.split()[0]) for line in sizes.splitlines()[1:]) <= 48_000


@pytest.mark.parametrize("name", ["A", "fish", "torpedo", "bluerov2", "octo"])
def test_tables_of_a_law_are_small_and_say_the_same(name: str) -> None:
    method = AllocatorCache().method(load_layout(name))
    robot = method.at(np.array(SPEED)).compiled if name == "torpedo" else method.compiled
    thin = thinned(robot.block)
    assert (
        max(sum(len(table.numbers) for table in row.values()) for row in tables_of(thin)) * 4
        <= 4096
    )
    assert len(thinned(thin)) <= len(thin)
    double = actuators_of(robot.block)
    single = actuators_of(thin)
    for limit in ("command_min", "command_max"):
        np.testing.assert_allclose(single[limit], double[limit], rtol=2e-7)


def test_cmake_builds_and_the_examples_compile(tmp_path: Path) -> None:
    folder = exported("bluerov2_heavy")
    ran(
        f"cmake -S . -B {tmp_path}/b -DFL_SINGLE=ON && cmake --build {tmp_path}/b && "
        f"{tmp_path}/b/selftest",
        folder,
    )
    (tmp_path / "src").symlink_to(folder)  # where a sketch of Arduino has its C files
    stubs = f'#include "{HERE / "stubs.hpp"}"\n'
    for example in sorted((folder / "examples").iterdir()):
        text = example.read_text()
        for header in re.findall(r"#include <(.*[/].*)>", text):
            (tmp_path / header).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / header).write_text(stubs)
        (tmp_path / "one.cpp").write_text(f'{stubs}#include "{example}"\n')
        ran(
            f"g++ -std=c++17 -Wall -Wextra -Werror -I{tmp_path} -I. -c {tmp_path}/one.cpp -o "
            f"{tmp_path}/o",
            folder,
        )


def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for _ in range(2):  # what an export left is replaced
        assert main(["export", "A", "--lost", "front_left", "--c", str(tmp_path / "c")]) == 0
    assert "3 fins" in capsys.readouterr().out
    assert "front_left" not in (tmp_path / "c" / "robot.h").read_text()
    (tmp_path / "c" / "mine.c").write_text("")
    assert "'mine.c'" in refused(["export", "A", "--c", str(tmp_path / "c")])
    assert "--c DIR" in refused(
        ["export", "torpedo", "-o", str(tmp_path / "e"), "--flow", *"100000"]
    )
    assert "no C sources" in refused(["export", "A", "--method", "mdn", "--c", str(tmp_path / "d")])


def _heavy_with(budget: dict[str, Any]) -> Layout:
    """BlueROV2 Heavy with a power budget."""
    return replace(load_layout("bluerov2_heavy"), **budget)


BUDGETS: tuple[dict[str, Any], ...] = (
    {"power_w": 80.0},
    {
        "buses": (
            Bus("front", 30.0, ("front_left", "front_right")),
            Bus("rear", 25.0, ("rear_left", "rear_right")),
        )
    },
)
"""Fields of a layout with one bus for all, and with two that leave thrusters without a limit."""


@pytest.mark.parametrize("budget", BUDGETS)
def test_a_power_budget_is_kept_as_by_the_library(budget: dict[str, Any], tmp_path: Path) -> None:
    layout = _heavy_with(budget)
    write_c(c_sources(layout), tmp_path)
    ran("gcc -std=c99 -O1 -Wall -Wextra -Werror *.c -lm -o it && ./it", tmp_path)
    ran("gcc -std=c99 -O1 -shared -fPIC *.c -lm -o it.so", tmp_path)
    library = ctypes.CDLL(str(tmp_path / "it.so"))
    allocator = Allocator(layout)
    command = np.zeros((layout.n, 3))
    rng = np.random.default_rng(6)
    binding = 0
    for _ in range(100):
        wrench = allocator.scale * rng.normal(size=6)
        code = library.fl_bluerov2_heavy_allocate(
            wrench.ctypes.data_as(ctypes.c_void_p), None, command.ctypes.data_as(ctypes.c_void_p)
        )
        answer = allocator.allocate(wrench, policy="direction")
        assert code == 0
        np.testing.assert_allclose(command[:, 0], answer.command[:, 0], rtol=0.0, atol=1e-9)
        binding += any("power" in word or "bus" in word for word in answer.binding)
    assert binding > 50


def test_a_power_budget_of_fins_is_kept_by_less_than_the_tables_are_off(tmp_path: Path) -> None:
    layout = replace(load_layout("A"), power_w=0.5)
    write_c(c_sources(layout), tmp_path)
    ran("gcc -std=c99 -O1 -shared -fPIC *.c -lm -o it.so", tmp_path)
    library = ctypes.CDLL(str(tmp_path / "it.so"))
    allocator = Allocator(layout)
    plant = plant_of(layout)
    command = np.zeros((layout.n, 3))
    rng = np.random.default_rng(7)
    for _ in range(100):
        wrench = allocator.scale * rng.normal(size=6)
        code = library.fl_a_allocate(
            wrench.ctypes.data_as(ctypes.c_void_p), None, command.ctypes.data_as(ctypes.c_void_p)
        )
        assert code == 0
        assert plant.power(command).sum() <= 0.5 * (1.0 + 1e-6)


def test_a_power_budget_of_a_robot_with_rudders_is_refused() -> None:
    with pytest.raises(AllocationError, match="no budget is kept yet for robots with rudders"):
        c_sources(replace(load_layout("torpedo"), power_w=216.0))


def test_a_power_budget_of_a_robot_with_a_rudder_in_a_slipstream_is_refused() -> None:
    layout = replace(load(random_robot("slipstreams", 0, 60)), power_w=50.0)
    with pytest.raises(AllocationError, match="no budget is kept yet by exports to C"):
        c_sources(layout)


def test_the_short_call_tells_where_rates_forbid_to_keep_a_budget(tmp_path: Path) -> None:
    """From full thrust on, drives that change by a twentieth of it in a tick cannot keep 100 W."""
    fast = load_layout("bluerov2_heavy")
    slow = [replace(actuator, rate=0.5 * actuator.force[1]) for actuator in fast.actuators]
    layout = replace(fast, actuators=slow, power_w=100.0)
    write_c(c_sources(layout), tmp_path)
    ran("gcc -std=c99 -O1 -shared -fPIC *.c -lm -o it.so", tmp_path)
    header = (tmp_path / "fl_bluerov2_heavy.h").read_text()
    code = int(re.findall(r"#define FL_BLUEROV2_HEAVY_OVER_BUDGET (\d+)", header)[0])
    library = ctypes.CDLL(str(tmp_path / "it.so"))
    library.fl_bluerov2_heavy_error_text.restype = ctypes.c_char_p
    assert b"more power than a bus may give" in library.fl_bluerov2_heavy_error_text(code)

    full = np.zeros((layout.n, 3))
    full[:, 0] = [actuator.force[1] for actuator in layout.actuators]
    wrench = np.zeros(6)
    command = np.full((layout.n, 3), np.nan)
    addresses = [each.ctypes.data_as(ctypes.c_void_p) for each in (wrench, full, command)]
    assert library.fl_bluerov2_heavy_allocate(*addresses) == code != 0
    np.testing.assert_allclose(command[:, 0], 0.95 * full[:, 0], rtol=1e-6)

    at_rest = np.zeros((layout.n, 3))
    addresses[1] = at_rest.ctypes.data_as(ctypes.c_void_p)
    assert library.fl_bluerov2_heavy_allocate(*addresses) == 0
