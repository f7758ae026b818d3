"""DEVELOPMENT.md follows one allocation through the files: a profile agrees, and C has its
functions."""

import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

import finlab

ROOT = Path(__file__).resolve().parents[2]
ROW = re.compile(r"^\| `(finlab/[\w/]+\.(?:py|c))` \| `([\w.]+)` \|", re.MULTILINE)
"""A row of the tables: a file and its function."""
Step = tuple[str, str]
"""A file and a function."""


def traced(title: str) -> list[Step]:
    """The steps of the table that follows a title in bold."""
    text = (ROOT / "DEVELOPMENT.md").read_text()
    _, _, rest = text.partition(f"**{title}**")
    table = rest.split("\n**")[0].split("\n## ")[0]
    steps = ROW.findall(table)
    assert steps, title
    return steps


def called(run: Callable[[], Any]) -> list[Step]:
    """The functions of the package that are called, in order."""
    steps: list[Step] = []

    def note(frame: FrameType, event: str, _: Any) -> None:
        path = Path(frame.f_code.co_filename)
        if event == "call" and path.is_relative_to(ROOT / "finlab"):
            steps.append((path.relative_to(ROOT).as_posix(), frame.f_code.co_qualname))

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        run()
    finally:
        sys.setprofile(before)
    return steps


def assert_in_order(steps: list[Step], profile: list[Step]) -> None:
    """Each step is in what is left of a profile after the step before it."""
    next_step = 0
    for step in steps:
        assert step in profile[next_step:], step
        next_step = profile.index(step, next_step) + 1


def test_an_allocator_is_made_as_traced() -> None:
    layout = finlab.load_layout("turtle_hybrid")
    finlab.Allocator(layout)  # imports what is imported once
    assert_in_order(traced("Once"), called(lambda: finlab.Allocator(layout)))


def test_a_question_goes_to_the_core_and_back_as_traced() -> None:
    allocator = finlab.Allocator(finlab.load_layout("turtle_hybrid"))
    profile = called(lambda: allocator.allocate([2, 0, 40, 0, 0, 0.5], lost=["front_left"]))
    there = traced("For each question")
    _, *back = traced(
        "And back"
    )  # the first step returns from a function that was called on the way there
    assert_in_order(there + back, profile)


@pytest.mark.parametrize("step", traced("In C"), ids=lambda step: step[1])
def test_the_core_has_what_is_traced(step: Step) -> None:
    path, function = step
    text = (ROOT / path).read_text()
    assert re.search(rf"^\w[\w *]*\b{function}\([^;{{]*\) {{", text, re.MULTILINE), step
