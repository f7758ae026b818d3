"""The page looks as it did when its pictures were stored; `tools/bench-app looks` compares all of them."""

from collections.abc import Iterator
from typing import Any

import pytest
from PIL import Image

from tests.browser.looks import (
    FOLDER,
    SIZES,
    STATES,
    THEMES,
    Look,
    comparable,
    differing,
    pictures,
    small,
    still,
    stored,
)

SOME = {"allocate": ((1400, 860), (900, 700)), "fin": ((1400, 860),)}


@pytest.fixture(scope="module")
def sharp(browser: Any, served: Any) -> Iterator[Any]:
    """A page that is drawn in full; where the stored pictures are of another browser, there is nothing to
    compare with."""
    from tests.browser.page import Page

    if not comparable(browser.version):
        pytest.skip("the stored pictures are of another Chromium or font: tools/bench-app looks --store")
    context = browser.new_context(viewport={"width": 1400, "height": 860})
    yield Page(context.new_page(), type(served)(served.url.replace("0.3", "1"), served.app, served.server))
    context.close()


def test_the_page_looks_as_stored(sharp: Any) -> None:
    for state, sizes in SOME.items():
        for look, picture in pictures(sharp, [state], sizes):
            tiles = differing(small(picture), stored(look))
            assert tiles == [], f"{look.path.name} looks different in tiles {tiles[:9]}"


def test_a_moved_panel_and_a_changed_colour_are_seen(sharp: Any) -> None:
    ((look, before),) = pictures(sharp, ["allocate"], SIZES[1:2], ("light",))
    panel = "document.querySelector('.fl-right').closest('.mantine-Paper-root')"
    moved = f"() => {panel}.style.translate = '-12px 12px'"
    back = moved.replace("-12px 12px", "")
    sharp.page.evaluate(moved)
    assert differing(small(still(sharp)), stored(look)) != []
    sharp.page.evaluate(back)
    name = "--mantine-primary-color-filled"
    paint = f"color => document.documentElement.style.setProperty('{name}', color)"
    sharp.page.evaluate(paint, "rgb(160, 60, 160)")
    assert differing(small(still(sharp)), stored(look)) != []
    sharp.page.evaluate(paint, "")
    soft = before.transform(
        before.size, Image.Transform.AFFINE, (1, 0, 0.35, 0, 1, 0.2), Image.Resampling.BILINEAR
    )
    assert differing(small(soft), stored(look)) == [], "as another machine draws edges"


def test_what_is_stored_is_small_and_known() -> None:
    known = {Look(state, size, theme).path.name for state in STATES for size in SIZES for theme in THEMES}
    names = {path.name for path in FOLDER.glob("*.webp")}
    assert len(known) == 112 and names == known
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) < 2_000_000
