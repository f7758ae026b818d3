"""The presenting view: one true sentence, the candidates, and no panel."""

from collections.abc import Iterator

import pytest

from finlab.layout import load_layout
from tests.webapp.test_faults import Tab
from webapp.panels.presenting import presented_plot, presented_words
from webapp.tasks.slot import Pools
from webapp.tasks.solver import NO_MODES


@pytest.fixture(scope="module")
def tab() -> Iterator[Tab]:
    """A page of U-CAT."""
    pools = Pools()
    tab = Tab(pools, load_layout("ucat"))
    tab.on_loop(lambda: tab.view.do(lambda: tab.view.session.show_drawer("Candidates")))
    tab.settle()
    yield tab
    tab.close()
    pools.stop()


def presented(tab: Tab) -> str:
    """What stands beside the robot; empty where nobody can see it."""
    for group in tab.view.board.groups:
        for rule in group.rules:
            if getattr(rule.make, "__name__", "") == "_presented":
                return str(rule.last) if group.is_visible else ""
    raise AssertionError("there is no such rule")


def test_nothing_is_there_until_it_is_asked_for(tab: Tab) -> None:
    session = tab.view.session
    assert presented(tab) == ""
    tab.on_loop(lambda: tab.view.do(lambda: session.toggle("presents")))
    tab.settle()
    words = presented(tab)
    assert "Asked: <b class='asked'>Fx 1.2 N and Tz 0.25 N m</b>" in words
    assert "The robot gives it with" in words and "data-press='mode'" in words
    tab.on_loop(lambda: tab.view.do(lambda: session.set_target(0, 300.0)))
    tab.settle()
    words = presented(tab)
    assert "Out of reach, closest." in words and "is left undone" in words
    assert "gives it" not in words
    tab.on_loop(lambda: tab.view.do(lambda: session.toggle("presents")))
    tab.settle()
    assert presented(tab) == ""


def test_candidates_are_there_whatever_the_task(tab: Tab) -> None:
    session = tab.view.session
    tab.on_loop(lambda: tab.view.do(session.start_over))
    tab.on_loop(lambda: tab.view.do(lambda: session.show_task("Design")))
    tab.on_loop(lambda: tab.view.do(lambda: session.toggle("presents")))
    tab.settle()
    assert session.desk.task == "Design" and "data-press='mode'" in presented(tab)
    tab.on_loop(lambda: tab.view.do(lambda: session.toggle("presents")))
    tab.settle()


def test_without_an_answer_it_says_so() -> None:
    assert "Working" in presented_words(None, True)
    assert presented_plot(NO_MODES, 0, None) == ""
