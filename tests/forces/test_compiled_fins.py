"""Compiled fins by content: what changes them, what does not, and the way through a file."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finlab.bundle_files import CHECKSUMS, archive_around, checksums, table_name
from finlab.errors import DataError
from finlab.forces import envelopes
from finlab.forces.compiled_fins import (
    compiled_bytes,
    compiled_fins,
    content_key,
    difference,
    parse_compiled,
)
from finlab.forces.fin_envelope import COST, FinEnvelope, fin_envelope
from finlab.layout import FinModelSpec, Limits, load_layout
from finlab.physics import make_law, write_table
from finlab.physics.energy import EnergyWeights
from finlab.physics.objective import Objective

DRAG, LIMITS, POWER = FinModelSpec("drag"), Limits(), Objective()
GRID = np.linspace(0.0, 0.6, 5), np.linspace(0.0, 2.1, 6), np.linspace(-np.pi, np.pi, 9)


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "fin.csv"
    write_table(path, make_law(FinModelSpec("soft", (("e", 0.2),))), *GRID)
    return path


def spec(path: Path) -> FinModelSpec:
    return FinModelSpec("table", (("path", str(path)),))


def test_the_key_is_that_of_the_content() -> None:
    key = content_key(DRAG, LIMITS, POWER)
    assert len(key) == 64 and int(key, 16) >= 0
    assert content_key(FinModelSpec("drag", (("area", 0.02),)), LIMITS, POWER) == key, "as the default is"
    others = [
        (FinModelSpec("drag", (("area", 0.021),)), LIMITS, POWER),
        (FinModelSpec("lighthill"), LIMITS, POWER),
        (DRAG, Limits(amplitude=(0.05, 0.61)), POWER),
        (DRAG, Limits(frequency=(0.2, 2.1)), POWER),
        (DRAG, Limits(zero_direction=(-1.0, 1.0)), POWER),
        (DRAG, LIMITS, Objective("effort")),
        (DRAG, LIMITS, Objective("effort", EnergyWeights(1.0, 0.5))),
        (DRAG, LIMITS, Objective("power", copper_loss=0.1)),
    ]
    assert len({key, *(content_key(*other) for other in others)}) == 1 + len(others)


def test_a_table_is_known_by_its_content_wherever_it_lies(table: Path, tmp_path: Path) -> None:
    key = content_key(spec(table), LIMITS, POWER)
    (tmp_path / "copy.csv").write_bytes(table.read_bytes())
    assert content_key(spec(tmp_path / "copy.csv"), LIMITS, POWER) == key
    table.write_bytes(table.read_bytes() + b"\n")
    assert content_key(spec(table), LIMITS, POWER) != key
    table.unlink()
    with pytest.raises(DataError, match=r"fin\.csv: no such file"):
        content_key(spec(table), LIMITS, POWER)


def test_tables_are_read_out_of_an_archive(table: Path, tmp_path: Path) -> None:
    import zipfile

    content = table.read_bytes()
    needed = {"layout.graph.json": b"", "bundle.json": b'{"version": 3}', "compiled_fins.safetensors": b""}
    files = {**needed, table_name(content): content}
    with zipfile.ZipFile(tmp_path / "x.zip", "w") as archive:
        for name, part in {**files, CHECKSUMS: checksums(files)}.items():
            archive.writestr(name, part)
    inside = tmp_path / "x.zip" / table_name(content)
    assert archive_around(inside) == str(tmp_path / "x.zip") and archive_around(table) is None
    assert archive_around(tmp_path / "y.zip" / table_name(content)) is None, "there is no such archive"
    assert archive_around(tmp_path / "x.zip" / "other" / "x.csv") is None
    assert content_key(spec(inside), LIMITS, POWER) == content_key(spec(table), LIMITS, POWER)
    command = np.array([[0.4, 1.1, 0.3]])
    np.testing.assert_array_equal(make_law(spec(inside)).force(command), make_law(spec(table)).force(command))
    with pytest.raises(DataError, match="no such file, expected a CSV table"):
        make_law(spec(inside.with_name("0" * 64 + ".csv")))


@pytest.mark.parametrize("objective", [POWER, Objective("effort")])
def test_a_file_holds_them_to_the_last_bit(objective: Objective, table: Path) -> None:
    layout = load_layout("mixed")
    layout = replace(layout, fins=(replace(layout.fins[0], model=spec(table)), *layout.fins[1:]))
    fins = compiled_fins(layout, objective)
    assert len(fins) == 3, "two of the four are alike"
    content = compiled_bytes(fins)
    back = parse_compiled(content, "x")
    assert compiled_bytes(back) == content and set(back) == set(fins)
    for key, fin in fins.items():
        for name in ("middle", "half", "smallest", "largest", "table"):
            np.testing.assert_array_equal(getattr(back[key], name), getattr(fin, name))
        assert difference(back[key], fin) == 0.0


def test_compiled_fins_are_taken_and_others_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    layout = load_layout("mixed")
    fins = compiled_fins(layout, POWER)
    missing = content_key(layout.fins[-1].model, layout.fins[-1].limits, POWER)
    asked: list[FinModelSpec] = []

    def spy(model: FinModelSpec, limits: Limits, objective: Objective) -> FinEnvelope:
        asked.append(model)
        return fin_envelope(model, limits, objective)

    monkeypatch.setattr(envelopes, "fin_envelope", spy)
    whole = envelopes.layout_envelopes(layout, POWER, fins)
    assert asked == []
    del fins[missing]
    part = envelopes.layout_envelopes(layout, POWER, fins)
    assert asked == [layout.fins[2].model, layout.fins[3].model]
    np.testing.assert_array_equal(whole.table, part.table)
    np.testing.assert_array_equal(whole.table, envelopes.layout_envelopes(layout, POWER).table)


def test_differences_are_shares() -> None:
    fin = fin_envelope(DRAG, LIMITS, POWER)
    assert difference(replace(fin, middle=fin.middle + 0.2 * np.pi), fin) == pytest.approx(0.1)
    assert difference(replace(fin, half=fin.half - 0.2 * np.pi), fin) == pytest.approx(0.1)
    assert difference(replace(fin, largest=0.9 * fin.largest), fin) == pytest.approx(0.1)
    assert difference(replace(fin, smallest=fin.smallest + 0.1 * fin.largest), fin) == pytest.approx(0.1)
    dearer = fin.table.copy()
    dearer[0, -1, COST] *= 1.1
    assert difference(replace(fin, table=dearer), fin) == pytest.approx(0.1)
    assert difference(replace(fin, table=fin.table[:, :-1]), fin) == np.inf
    assert np.isnan(difference(replace(fin, largest=fin.largest * np.nan), fin))
