"""Force tables rounded for a link: as accurate as is said, small enough, and safe whatever a link holds."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finlab.errors import DataError, FinlabError
from finlab.fit.fin_file import GRID
from finlab.layout import FinModelSpec, Layout, load_layout
from finlab.physics import make_law, plant_of
from finlab.physics.table_file import parse_table
from webapp.session.companions import stored_table
from webapp.session.design_links import MAX_LINK, ROUNDED, linked, unpacked
from webapp.session.files import table_folder
from webapp.session.rounded_tables import LEVELS, NOTE, accuracy, rounded, written


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def fitted(seed: int = 0, amplitude: float = 0.6, waves: float = 0.03) -> bytes:
    """A table as a fit writes it: of its grid, with power, uncertainties and notes, no two values alike."""
    random = np.random.default_rng(seed)
    axes = [np.linspace(0, amplitude, GRID[0]), np.linspace(0, 2.08, GRID[1])]
    axes += [np.linspace(-np.pi, np.pi, GRID[2], endpoint=False)]
    command = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    force = make_law(FinModelSpec("soft")).force(command) * (1 + 0.1 * random.random(3))
    force += waves * np.sin(command @ random.normal(size=(3, 3))) * command[:, :1]
    power = 0.8 * np.linalg.norm(force, axis=1, keepdims=True) ** 1.5
    rows = np.hstack([command, force, power, 0.01 + 0.02 * np.abs(force)]) + 0.0
    lines = ["# fitted to 179 samples", "# thrust leans -4.4 deg", "A,f,phi,Fx,Fy,Fz,P,sFx,sFy,sFz"]
    return "\n".join([*lines, *(",".join(f"{v:.6g}" for v in row) for row in rows), ""]).encode()


def robot(*tables: bytes) -> Layout:
    layout = load_layout("ucat")
    models = [stored_table(content, table_folder()) for content in tables]
    fins = [replace(fin, model=models[k % len(models)]) for k, fin in enumerate(layout.fins)]
    return replace(layout, fins=tuple(fins))


@pytest.mark.parametrize("levels", LEVELS)
def test_a_rounded_table_is_as_accurate_as_it_says_and_rounds_no_further(levels: int) -> None:
    content, share = fitted(), 0.5 / levels
    before, copy = parse_table(content, "a"), written(rounded(content, "a", levels), "a")
    after = parse_table(copy, "b")
    for old, new in zip(before.grid.axes, after.grid.axes, strict=True):
        assert np.array_equal(old, new)
    error = np.abs(after.grid.values - before.grid.values)
    assert error[..., :3].max() <= share * np.abs(before.grid.values[..., :3]).max() * (1 + 1e-9)
    assert error[..., 3].max() <= share * before.grid.values[..., 3].max() * (1 + 1e-9)
    assert error.max() > 0.0, "rounded it is"
    assert (
        after.periodic
        and after.notes[:-1] == before.notes
        and after.notes[-1].startswith(NOTE + accuracy(levels))
    )
    assert written(rounded(copy, "b", levels), "b") == copy


@pytest.mark.parametrize("turn", [np.pi, 1.2])
def test_grids_without_power_and_with_part_of_a_circle_keep_their_shape(turn: float) -> None:
    rows = [f"{a},{f},{d},0,{a * f},{d}" for a in (0.1, 0.5) for f in (1, 2) for d in (-turn, 0, 1, turn)]
    rows = [row.rsplit(",", 1)[0] + ",0.5" if turn == np.pi else row for row in rows]
    content = "\n".join(["A,f,phi,Fx,Fy,Fz", *rows]).encode()
    before, after = parse_table(content, "a"), parse_table(written(rounded(content, "a"), "a"), "b")
    assert before.periodic == after.periodic == (turn == np.pi)
    assert before.grid.values == pytest.approx(after.grid.values, abs=1e-4)
    assert not after.has_power


def test_a_robot_of_fitted_fins_goes_by_a_link_and_pushes_the_same() -> None:
    for layout, share in (
        (robot(fitted()), 0.0015),
        (robot(fitted(waves=0.003), fitted(1, 0.5, 0.003)), 0.024),
    ):
        link = linked(layout)
        assert len(link.text) < MAX_LINK and link.text[0] == ROUNDED
        assert f"are rounded, to {share} % of their largest force" in link.rounded
        there = unpacked(link.text).layout
        command = np.random.default_rng(0).uniform((0, 0, -np.pi), (0.6, 2.1, np.pi), (200, 4, 3))
        mine, other = plant_of(layout), plant_of(there)
        values = np.abs(parse_table(fitted(), "a").grid.values)
        largest, most_power = values[..., :3].max(), values[..., 3].max()
        # Four fins; cubic weights of each axis add up to at most 1.25; arms are below one metre.
        assert mine.wrench(command) == pytest.approx(
            other.wrench(command), abs=4 * 2 * 2 * share / 100 * largest
        )
        assert mine.power(command) == pytest.approx(
            other.power(command), abs=4 * 2 * 2 * share / 100 * most_power
        )
        assert [replace(fin, model=FinModelSpec()) for fin in there.fins] == [
            replace(fin, model=FinModelSpec()) for fin in layout.fins
        ]


def test_what_fits_whole_goes_whole_and_what_does_not_fit_is_told() -> None:
    assert linked(load_layout("ucat")).rounded == ""
    random = np.random.default_rng(0)
    rows = [
        ",".join(f"{v:.6g}" for v in (a, f, d, *random.normal(size=3)))
        for a in np.linspace(0.1, 0.6, 14)
        for f in np.linspace(0.1, 2, 14)
        for d in np.linspace(-3, 3, 14)
    ]
    noise = "\n".join(["A,f,phi,Fx,Fy,Fz", *rows]).encode()
    with pytest.raises(FinlabError, match=r"needs [\d,]+ characters, a link carries 16,000; save it, .* ZIP"):
        linked(robot(noise))


HEAD = [[[0, 1], [0, 1], [0, 1]], [1, 1, 1], False, []]


@pytest.mark.parametrize(
    "head",
    [
        HEAD[:2],
        [[[0, 1], [0, 1]], *HEAD[1:]],
        [[[0, 1], [0, 1], []], *HEAD[1:]],
        [[[0, 1], [0, 1], [0, 1, 2]], *HEAD[1:]],
        [[[0, 1], [0, 1], [0, "x"]], *HEAD[1:]],
        [HEAD[0], [1, 1], False, []],
        [HEAD[0], [1, 1, None], False, []],
        [*HEAD[:3], 7],
        7,
        None,
    ],
)
def test_a_strangers_table_is_refused_with_a_sentence(head: object) -> None:
    content = json.dumps(head).encode() + b"\n" + bytes(4 * 3 * 8)
    with pytest.raises(DataError) as told:
        parse_table(written(content, "x.csv"), "x.csv")
    assert str(told.value).startswith("x.csv: ")


def test_a_note_cannot_become_a_row() -> None:
    head = [*HEAD[:3], ["a\nb\rA,f\u2028c"]]
    content = (
        json.dumps(head).encode() + b"\n" + np.full(24, 2, "<u4").view(np.uint8).reshape(-1, 4).T.tobytes()
    )
    text = written(content, "x.csv")
    assert parse_table(text, "x.csv").grid.values.shape == (2, 2, 2, 3)
