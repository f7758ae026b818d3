"""What is around an answer: swims, a slider of the app, trainings, a robot that is prepared, and
the first answer of a process."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from finlab import Allocator
from finlab.layout import Layout
from finlab.research.evaluation.document import Row
from finlab.research.random_layouts import random_robot, random_thruster
from finlab.swim.control import make_controller
from finlab.swim.simulation import ClosedLoop, make_trajectory
from tools.speed_groups.questions import allocator_of, unit_side
from tools.speed_groups.timing import Goal, Side, Sizes, figure_row, least_times, left_out_row

SWIMMERS = ("bluerov2_heavy", "A")
"""Robots that swim."""
PATH = "lissajous"
"""Which path they swim."""
LEAST_SPEED = Goal(300, is_least=True)
"""Simulated seconds per second of the processor."""
SWIMS = 3
"""Of each robot; the quickest one counts."""
MOST_OF_SLIDER = Goal(15)
"""Of a step of a slider, over an answer."""
MOST_OF_STEP = Goal(15)
"""Of a step of a training, over its matrix products."""
PREPARED = {8: None, 64: Goal(5400)}
"""Numbers of thrusters of robots that are prepared, and goals over the unit: 20 ms where the unit
takes 3.7 us."""
PREPARATIONS = 5
"""Of each robot; the quickest one counts."""
MOST_OF_START = Goal(2.3)
"""Of the first answer of a process, over a process that imports numpy alone."""
STARTS = 5
"""Of each process; the quickest one counts."""
NO_BYTE_CODE = "PYTHONDONTWRITEBYTECODE"
"""With this variable Python compiles all modules in each process."""
FIRST_ANSWER = """
import finlab
finlab.Allocator(finlab.load_layout("bluerov2_heavy")).allocate([20, 0, 10, 0, 0, 1]).command
"""
"""The program whose first answer is timed."""


def around_rows(sizes: Sizes) -> Iterator[Row]:
    """Returns the rows of what is around an answer."""
    for robot in SWIMMERS:
        yield _row_of_swim(robot, sizes.swim_s)
    yield from slider_rows(sizes)
    yield from training_rows(sizes)
    yield from _rows_of_preparing(sizes)
    yield _row_of_start()


def _row_of_swim(robot: str, duration_s: float) -> Row:
    """The row of a robot that swims, as `finlab simulate` lets it."""
    layout = allocator_of(robot).layout
    least_s = np.inf
    for _ in range(SWIMS):
        loop = ClosedLoop(
            layout,
            Allocator(layout),
            make_trajectory(PATH, duration_s),
            make_controller("tracking", layout),
        )
        start_s = time.thread_time()
        loop.run()
        least_s = min(least_s, time.thread_time() - start_s)
    speed = duration_s / least_s
    over = "a second of the processor"
    return figure_row("simulated seconds of a swim", robot, over, speed, LEAST_SPEED)


def slider_rows(sizes: Sizes) -> Iterator[Row]:
    """Returns the rows of a slider that is dragged in the app, by `tools/slider.py`."""
    measured = "a step of a slider, all threads of the app"
    over = "`allocate` and `err_norm`"
    if find_spec("viser") is None:
        yield left_out_row(measured, "ucat", over, "viser")
        return
    from tools.slider import Case, step_cost

    for case in (Case("ucat"), Case("bluerov2_heavy", first=10.0, step=0.4)):
        cost = step_cost(case, drags=sizes.drags, singles=sizes.drags)
        ratio = cost.drag_ms / cost.answer_ms
        yield figure_row(measured, case.robot, over, ratio, MOST_OF_SLIDER)


def training_rows(sizes: Sizes) -> Iterator[Row]:
    """Returns the rows of a step of each training of method `paper`."""
    over = "its matrix products"
    if find_spec("torch") is None:
        yield left_out_row("a step of a training", "any", over, "torch")
        return
    from finlab.research.paper.training.training_costs import training_costs

    with TemporaryDirectory() as folder:
        costs = training_costs("smoke", Path(folder), sizes.steps)
    for name, cost in costs.items():
        measured = f"a step of the training of the {name}"
        yield figure_row(measured, "any", over, cost.ratio, MOST_OF_STEP)


def _rows_of_preparing(sizes: Sizes) -> Iterator[Row]:
    """Rows of robots that are prepared."""
    sides = {"unit": unit_side(sizes.questions)}
    for count in PREPARED:
        sides[str(count)] = Side(partial(Allocator, _thrusters(count)), [()])
    times = least_times(sides, PREPARATIONS)
    for count, goal in PREPARED.items():
        robot = f"{count} thrusters"
        ratio = float(times[str(count)][0] / np.median(times["unit"]))
        yield figure_row("`Allocator(layout)`", robot, "the unit", ratio, goal)


def _thrusters(count: int) -> Layout:
    """A random robot of so many thrusters."""
    rng = np.random.default_rng(count)
    return random_robot(rng, f"thrusters-{count}", (count, count), (random_thruster,))


def _row_of_start() -> Row:
    """The row of the first answer of a process."""
    programs = {"import": "import numpy", "answer": FIRST_ANSWER}
    least_s = dict.fromkeys(programs, np.inf)
    for _ in range(STARTS):
        for name, program in programs.items():
            least_s[name] = min(least_s[name], _processor_s(program))
    ratio = least_s["answer"] / least_s["import"]
    measured = "the first answer of a process"
    over = "a process with `import numpy` alone"
    return figure_row(measured, "bluerov2_heavy", over, ratio, MOST_OF_START)


def _processor_s(program: str) -> float:
    """Processor time of a process that runs a program [s]."""
    import resource

    # Modules are compiled by the first process, as on any machine where they are used twice.
    environment = {key: value for key, value in os.environ.items() if key != NO_BYTE_CODE}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-c", program], check=True, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    user_s = after.ru_utime - before.ru_utime
    system_s = after.ru_stime - before.ru_stime
    return user_s + system_s
