"""A short random walk over the boxes for numbers; `python -m tests.browser.random_fields` is the long one."""

from typing import Any

from tests.browser.random_fields import Walk

ACTIONS = 40


def test_the_page_agrees_with_the_model(new_page: Any) -> None:
    page = new_page()
    walk = Walk(page, seed=7)
    for _ in range(ACTIONS):
        walk.act()
    assert walk.done.total() == ACTIONS and len(walk.done) >= 6
    page.page.context.close()
