"""A file of measurements dropped on a fin: the fit, undo, refusals; layouts that carry their
tables."""

import io
import threading
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from finlab.actuators.fin.fin_model import DOUBT
from finlab.actuators.fin.force_table_file import table_bytes
from finlab.actuators.thrust_model import PowerTable
from finlab.allocation import Allocator
from finlab.errors import DataError, FinlabError, LayoutError
from finlab.files.guarded import packed
from finlab.fit import fin_fit
from finlab.layout import Layout, Thruster, load_layout
from finlab.swim.design_files import read_archive, stored_table
from tests.fit.load_cell import columns_of, commands, measured, soft, write
from tests.fit.test_thruster_fit import T200
from tests.webapp.stand_in import LoneBell, context_of, until
from webapp.markup.outcomes import fit_card
from webapp.panels.actuator_model import model_card
from webapp.session import Session, files
from webapp.tasks import fitting
from webapp.tasks.fitting import Fitting
from webapp.tasks.slot import Pool

LAW = soft(k=4.0, p=1.4, x0=0.9, q=4.0, e=0.15, phi_e=1.0, d=0.12)
"""The law of the fin that is measured."""


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where tables are kept in these tests."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "finlab" / "tables"


def cell(tmp_path: Path, n: int = 70) -> bytes:
    """A file of noisy measurements, one of which is wild."""
    command = commands(n)
    force = measured(LAW, command)
    force[5, 1] += 4.0
    return write(tmp_path / "cell.csv", columns_of(command, force)).read_bytes()


class Opened:
    """A page without a browser."""

    def __init__(self, worker: Pool) -> None:
        self.session = Session(load_layout("ucat"))
        context = context_of(worker, self.session)
        assert isinstance(context.bell, LoneBell)
        self.refused = context.bell.refused
        self.stages = context.bell.stages
        self.fitting = Fitting(context)

    @property
    def models(self) -> list[str]:
        return [fin.model.type for fin in self.session.state.layout.fins]


def test_a_noisy_file_becomes_the_fins_model_and_undo_takes_it_off(
    tmp_path: Path, worker: Pool
) -> None:
    opened = Opened(worker)
    before = opened.session.state
    fitting = opened.fitting
    fitting.start("back_left", "../cell.csv", cell(tmp_path))
    with pytest.raises(FinlabError, match="under way already"):
        fitting.start("back_left", "cell.csv", b"")
    until(lambda: fitting.answer is not None)
    until(lambda: opened.session.state != before)
    assert "looking for samples that contradict the others" in opened.stages
    assert opened.models == ["drag", "drag", "table", "drag"]
    assert opened.session.history.undo_name == "Fit back_left"
    found = fitting.answer
    assert found is not None and found.fit is not None and found.upload.content == b""
    card = fit_card(found)
    assert "May be trusted" in card and "1 of 70 samples contradicts the others" in card
    assert "cell.csv line 7." in card and "Fitted to 69 samples" in card
    answer = Allocator(opened.session.state.layout).allocate([0.5, 0, 0.2, 0, 0, 0.05])
    assert answer.err_norm < 1e-6
    fitting.put_on_all()
    assert opened.models == ["table"] * 4 and opened.session.history.undo_name == "Fit 3 actuators"
    with pytest.raises(FinlabError, match="no other actuator"):
        fitting.put_on_all()
    opened.session.undo()
    opened.session.undo()
    assert opened.session.state == before


def test_a_bench_table_becomes_a_thruster_and_goes_on_those_like_it(worker: Pool) -> None:
    opened = Opened(worker)
    opened.session.open_layout(load_layout("bluerov2"))
    before = opened.session.state.layout
    first = opened.session.state.layout.actuators[0]
    opened.fitting.start(first.name, "t200.csv", T200.read_bytes())
    until(lambda: opened.session.state.layout != before)
    found = opened.fitting.answer
    part = opened.session.state.layout.actuators[0]
    assert found is not None and isinstance(part, Thruster) and isinstance(part.model, PowerTable)
    assert part.force == (part.model.rows[0][1], part.model.rows[-1][1]) and part.axis == first.axis
    assert "Force -39.91 to 51.44 N" in fit_card(found) and "<b>table</b> of" in model_card(part)
    opened.fitting.put_on_all()
    alike = [p.model for p in before.actuators].count(first.model)
    assert [p.model for p in opened.session.state.layout.actuators].count(part.model) == alike
    opened.session.open_layout(load_layout("torpedo"))
    rudder = next(p.name for p in opened.session.state.layout.actuators if p.type == "rudder")
    with pytest.raises(FinlabError, match="is a rudder"):
        opened.fitting.start(rudder, "t200.csv", b"")


def test_a_finished_table_is_recognized(tmp_path: Path, worker: Pool) -> None:
    opened = Opened(worker)
    opened.fitting.start("back_left", "cell.csv", cell(tmp_path))
    until(lambda: "table" in opened.models)
    path = str(opened.session.state.layout.fins[2].model.values()["path"])
    opened.fitting.start("front_left", "fin.csv", table_bytes(path))
    until(lambda: opened.models == ["drag", "table", "table", "drag"])
    found = opened.fitting.answer
    assert (
        found is not None and found.fit is None and "fin.csv is a finished table" in fit_card(found)
    )
    assert opened.session.state.layout.fins[1].model == opened.session.state.layout.fins[2].model
    words = model_card(opened.session.state.layout.fins[1])
    assert "<b>table</b>, fitted to 69 samples" in words and "all round" in words


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        (
            "cell.csv",
            b"A,f,Fy,Fz\n0.1,1,1,x\n",
            "cell.csv: line 2, column Fz, holds 'x', which is not a number",
        ),
        ("cell.csv", b"A,f,Fy,Fz\n0.1,1,1,1\n", "cell.csv: 1 samples, expected at least 20"),
        ("picture.png", b"\x89PNG\x0d\x0a\xff\xfe", "picture.png: is not UTF-8 text"),
        ("empty.csv", b"", "empty.csv: "),
    ],
)
def test_bad_files_get_a_sentence_and_change_nothing(
    name: str, content: bytes, sentence: str, worker: Pool, cache: Path
) -> None:
    opened = Opened(worker)
    before = opened.session.state
    opened.fitting.start("back_left", name, content)
    until(lambda: bool(opened.refused))
    assert opened.refused[0].startswith(f"Not fitted: {sentence}"), "without the server's folder"
    assert opened.session.state == before and not opened.fitting.busy and not cache.exists()


def test_large_files_and_unknown_fins_are_refused_at_once(
    worker: Pool, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = Opened(worker)
    with pytest.raises(FinlabError, match="nobody"):
        opened.fitting.start("nobody", "cell.csv", b"")
    monkeypatch.setattr(fitting, "MAX_BYTES", 10)
    with pytest.raises(DataError, match="cell.csv: has 11 bytes, expected at most 10"):
        opened.fitting.start("back_left", "cell.csv", b"12345678901")
    assert not opened.fitting.busy


def test_what_was_cancelled_or_left_comes_to_nothing(tmp_path: Path, worker: Pool) -> None:
    opened = Opened(worker)
    gate = threading.Event()
    before = opened.session.state
    worker.submit(lambda: gate.wait(30))
    opened.fitting.start("back_left", "cell.csv", cell(tmp_path))
    opened.fitting.forget()
    gate.set()
    worker.submit(lambda: None).result(60)
    until(lambda: True)
    assert opened.session.state == before and opened.stages == []


def test_a_cancelled_fit_ends_at_its_next_step(
    tmp_path: Path, worker: Pool, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = Opened(worker)
    begun = threading.Event()
    gate = threading.Event()
    steps: list[int] = []
    component = fin_fit.Component

    def held(*args: Any, **options: Any) -> object:
        steps.append(len(steps))
        begun.set()
        assert gate.wait(30)
        return component(*args, **options)

    monkeypatch.setattr(fin_fit, "Component", held)
    opened.fitting.start("back_left", "cell.csv", cell(tmp_path))
    assert begun.wait(30)
    opened.fitting.forget()
    gate.set()
    worker.submit(lambda: None).result(60)
    opened.fitting.attend()
    assert steps == [0] and opened.refused == []


def test_a_fin_that_became_another_meanwhile_is_left_alone(tmp_path: Path, worker: Pool) -> None:
    opened = Opened(worker)
    gate = threading.Event()
    worker.submit(lambda: gate.wait(30))
    opened.fitting.start("back_left", "cell.csv", cell(tmp_path))
    opened.session.open_layout(load_layout("penta"))
    gate.set()
    until(lambda: bool(opened.refused))
    assert "back_left is no longer what cell.csv was for" in opened.refused[0]
    assert "table" not in opened.models and opened.fitting.answer is None


def test_two_pages_fit_at_once_each_its_own(tmp_path: Path, worker: Pool) -> None:
    one = Opened(worker)
    other = Opened(worker)
    content = cell(tmp_path)
    one.fitting.start("back_left", "one.csv", content)
    other.fitting.start("front_left", "other.csv", content)
    until(lambda: "table" in other.models)
    assert one.models == ["drag", "drag", "table", "drag"]
    assert other.models == ["drag", "table", "drag", "drag"]
    assert one.fitting.answer is not None and one.fitting.answer.upload.name == "one.csv"


def test_doubts_come_first(tmp_path: Path, worker: Pool) -> None:
    opened = Opened(worker)
    opened.fitting.start("back_left", "few.csv", cell(tmp_path, 25))
    until(lambda: "table" in opened.models)
    assert opened.fitting.answer is not None
    assert fit_card(opened.fitting.answer).startswith(
        "<div class='fl'><div class='said'><b class='missing'>Not to be trusted: "
    )
    fin = opened.session.state.layout.fins[2]
    assert DOUBT in model_card(fin) and DOUBT not in model_card(fin, has_doubts=False)


def robot(tmp_path: Path, cache: Path) -> Layout:
    """U-CAT with one measured fin."""
    from finlab.actuators.fin.force_table_file import write_table
    from finlab.layout import FinModelSpec
    from finlab.physics import make_law

    grid = [[0.05, 0.3, 0.6], [0.1, 1.0, 2.1], [-3.0, -1.5, 0.0, 1.5]]
    write_table(tmp_path / "mine.csv", make_law(FinModelSpec("soft")), *grid)  # type: ignore[arg-type]
    spec = stored_table((tmp_path / "mine.csv").read_bytes(), cache)
    return replace(load_layout("ucat").replace_actuator("back_left", model=spec), name="my robot")


def test_a_layout_carries_its_tables_elsewhere(tmp_path: Path, cache: Path) -> None:
    layout = robot(tmp_path, cache)
    name, content = files.layout_file(layout)
    assert name == "my_robot.zip" and files.layout_file(layout) == (name, content)
    elsewhere = tmp_path / "elsewhere"
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        archive.extractall(elsewhere)
    for path in cache.glob("*.csv"):
        path.unlink()
    opened = load_layout(elsewhere / "my_robot.yaml")
    answer = Allocator(opened).allocate([0.5, 0, 0.2, 0, 0, 0.05])
    assert answer.err_norm < 1e-6
    (tmp_path / name).write_bytes(content)
    with pytest.raises(
        DataError, match=r"holds 'my_robot\.yaml', .*; unpack it, and name the layout file in it"
    ):
        load_layout(tmp_path / name)
    again = files.read_layout(name, content).layout
    assert again == layout and table_bytes(str(again.fins[2].model.values()["path"]))
    assert files.layout_file(load_layout("ucat"))[0] == "ucat.yaml"


def test_limits_beyond_what_was_measured_are_told(tmp_path: Path, cache: Path) -> None:
    fin = robot(tmp_path, cache).fins[2]
    assert "at the edge" not in model_card(fin)
    wide = replace(fin, limits=replace(fin.limits, frequency=(0.1, 3.0)))
    assert "may be asked for 34° and 3.00 Hz" in model_card(wide)


def test_a_bundle_opens_in_the_app(tmp_path: Path, cache: Path) -> None:
    from finlab.deploy.bundle import make_bundle

    layout = robot(tmp_path, cache)
    content = make_bundle(Allocator(layout)).zip_bytes()
    assert files.read_layout("robot.zip", content).layout.fins[2].model == layout.fins[2].model
    with pytest.raises(DataError, match=r"^robot\.zip: cannot be read as a zip archive"):
        files.read_layout("robot.zip", content.replace(b"robot.json", b"rob@t.json", 1))


@pytest.mark.parametrize(
    ("parts", "sentence"),
    [
        (
            {"a.yaml": b"x", "b.yaml": b"y"},
            "2 of them layouts; expected a bundle, or one layout file",
        ),
        (
            {"a.yaml": b"x", "../out.csv": b"y"},
            "holds '../out.csv', expected a layout file, CSV tables",
        ),
        ({"a.yaml": b"x", "run.py": b"y"}, "holds 'run.py'"),
        ({"a.yaml": b"name: 3"}, "robot.zip/a.yaml: "),
    ],
)
def test_other_archives_are_refused(parts: dict[str, bytes], sentence: str, tmp_path: Path) -> None:
    with pytest.raises(LayoutError) as raised:
        read_archive("robot.zip", packed(parts), tmp_path / "kept")
    assert sentence in str(raised.value) and str(raised.value).startswith("robot.zip")
    assert not (tmp_path / "kept").exists()
    with pytest.raises(LayoutError, match=r"^robot\.zip: cannot be read as a zip archive"):
        read_archive("robot.zip", b"no zip", tmp_path)
