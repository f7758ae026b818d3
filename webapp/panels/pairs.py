"""Mirror pairs that a change breaks up: the page says so."""

from collections.abc import Callable
from functools import wraps
from typing import Any

from finlab.layout import Layout
from webapp.page import Page


def telling_pairs(page: Page, act: Callable[..., object]) -> Callable[..., None]:
    """An act that also says which actuators move by themselves after it.

    Args:
        page: the page on which it is said.
        act: changes the robot of the page.
    """

    @wraps(act)
    def told(*arguments: Any) -> None:
        before = page.session.state.layout
        act(*arguments)
        sentence = broken_pairs_words(before, page.session.state.layout)
        if sentence:
            page.notify("Not linked any more", sentence, calm=True)

    return told


def broken_pairs_words(before: Layout, now: Layout) -> str:
    """Which actuators of mirror pairs have none any more, as a sentence; nothing where all have, or
    are gone themselves.

    Args:
        before: the robot before a change under which actuators keep their names.
        now: the same after it.
    """
    paired = {name for pair in now.mirror_pairs for name in pair}
    sentences = []
    for first, second in before.mirror_pairs:
        alone = [name for name in (first, second) if name in now.names and name not in paired]
        if len(alone) == 2:
            sentences.append(f"{first} and {second} are no mirror images now, each moves by itself")
        elif alone:
            other = second if alone[0] == first else first
            sentences.append(f"{alone[0]} moves by itself: it is not linked to {other} any more")
    return "; ".join(sentences)
