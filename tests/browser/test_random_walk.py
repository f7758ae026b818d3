"""A short random walk over the controls of the app; `tools/bench-app walk` is the long one."""

from typing import Any

import pytest

from tests.browser.walk.walk import Walk

ACTIONS = 30
SHORT = {"box": 30, "choice": 9, "tick": 9, "press": 14, "slider": 6, "row": 10, "key": 10, "bar": 6}
"""Without searches, swims and files, which have flows of their own."""


def test_the_page_agrees_with_the_model(new_page: Any) -> None:
    page = new_page()
    walk = Walk(page, seed=7, kinds=SHORT)
    for _ in range(ACTIONS):
        walk.act()
    assert walk.done.total() == ACTIONS and len(walk.done) >= 5
    page.session.set_target(0, 1.25)  # nobody pressed anything
    with pytest.raises(AssertionError, match="target: "):
        walk.compare(patience=0.5)
    page.page.context.close()
