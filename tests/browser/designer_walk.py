"""A designer's walk, with real keys: from nothing to a robot of six measured fins around a hull from a file,
named, improved within constraints, compared, shared by a link, and taken home as a bundle."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import trimesh

from finlab.layout import FinModelSpec
from finlab.physics import make_law
from finlab.physics.table_file import write_table
from tests.browser.test_designs_flow import write
from tests.browser.test_inspector_flow import typed

GRID = ([0.05, 0.3, 0.6], [0.1, 0.7, 1.4, 2.1], [-3.0, -2.0, -1.0, 0.0, 1.0, 2.0])
"""Amplitudes, frequencies and directions that were measured."""
PAIRS = (
    ("front_left", "0.19", "13 cm", "0", "1/3*210"),
    ("middle_left", "0", "15 cm", "3 cm", "90"),
    ("back_left", "-19 cm", ".13", "0", "110"),
)
"""Name of the left fin of each pair, where it stands (x, y, z), and its shaft, as one may type it."""


def files(folder: Path) -> tuple[Path, Path]:
    """A hull that was drawn elsewhere, and a table that was measured; both small enough for a link."""
    hull, table = folder / "hull.stl", folder / "fin.csv"
    shape = trimesh.creation.icosphere(subdivisions=2)
    shape.vertices *= 300.0, 110.0, 80.0  # in mm, as CAD programs have it
    shape.export(hull)
    write_table(table, make_law(FinModelSpec("soft")), *GRID)  # type: ignore[arg-type]
    return hull, table


def describe(page: Any, fin: int, texts: tuple[str, ...]) -> None:
    """A row of the list, cell by cell, with Tab between them."""
    keys, cell = page.page.keyboard, page.page.locator(f"[data-edit=fin-name][data-key='{fin}']")
    cell.dblclick()
    for word, text in zip(("name of", "x of", "y of", "z of", "shaft of"), texts, strict=True):
        page.page.locator(f"input.fl-editor[aria-label^='{word}']").wait_for()
        keys.type(text, delay=10)
        keys.press("Enter" if word == "shaft of" else "Tab")
    page.until(lambda: page.page.locator(".fl-editor").count() == 0)


def is_better(progress: Any) -> bool:
    """Whether a search has found a way on."""
    return progress is not None and abs(progress.best) > 1.2 * abs(progress.before)


def walk(page: Any, folder: Path) -> Iterator[str]:
    """Go step by step; gives the name of each when it has been taken."""
    session, (hull, table) = page.session, files(folder)
    page.tab("Design")
    page.press("New")
    page.until(lambda: session.state.layout.name == "New robot" and not page.view.busy)
    yield "new"

    page.page.locator(".fin-list [data-press=robot]").click()
    page.unfold("Hull", "Unit of file")
    page.choose("Unit of file", "mm")
    page.upload("Open", hull)
    page.until(lambda: session.history.undo_name == "Import hull")
    page.press("All")
    page.until(lambda: session.state.layout.body.mass_kg is not None)
    write(page, "robot-name", "Manta")
    write(page, "robot-about", "Six soft fins around a hull of 60 cm.", end="Control+Enter")
    page.until(lambda: session.state.layout.description.startswith("Six soft"))
    yield "hull"

    for pair, texts in enumerate(PAIRS):
        if pair:
            page.press("Add a fin")
            page.until(lambda pair=pair: session.state.layout.n_fins == 2 * pair + 1)
        describe(page, 2 * pair, texts)
        page.press("Mirror")
        page.until(lambda pair=pair: session.state.layout.n_fins == 2 * pair + 2)
    page.until(lambda: not page.view.busy)
    yield "six-fins"

    page.upload("Open", table)
    page.until(lambda: page.view.fitting.findings is not None)
    page.press("On all like it")
    page.until(lambda: {fin.model.type for fin in session.state.layout.fins} == {"table"})
    page.until(lambda: not page.view.busy)
    yield "measured"

    page.tab("Reach")
    page.press("Pin this layout")
    page.press("forces")
    page.tab("Improve")
    for fin in range(4):
        page.page.locator(f".fin-list [data-press=locked][data-key='{fin}']").click()
    page.until(lambda: len(session.state.locked) == 4)  # the last pair alone may move
    typed(page, "Apart [m]", "3 cm")
    typed(page, "Reach ± [m]", "4 cm")
    page.until(lambda: session.draft.apart_m == 0.03 and session.draft.way("all")[0] == 0.04)
    page.press("Search")
    page.until(lambda: is_better(page.view.improver.progress))
    page.press("Cancel")
    page.until(lambda: page.view.improver.findings is not None)
    yield "improved"

    page.press("Accept")
    page.until(lambda: session.history.undo_name == "Improve the layout")
    page.tab("Reach")
    page.until(lambda: page.view.analyst.findings is not None and not page.view.analyst.busy)
    yield "compared"

    page.tab("Allocate")
    page.press("Dive")
    page.until(lambda: not page.view.busy)
    yield "allocated"

    page.press("Share")
    page.page.locator(".fl-share input").wait_for()
    yield "shared"

    page.page.keyboard.press("Escape")
    page.until(lambda: page.page.locator(".fl-share").count() == 0)
    page.tab("Export")
    with page.page.expect_download() as download:
        page.press("Export the bundle (ZIP)")
    download.value.save_as(folder / "robot.zip")
    yield "exported"
