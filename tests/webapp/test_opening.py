"""Files that a browser sends, whatever they are: each is opened by its kind, or a sentence says why not."""

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from finlab.actuators.fin.table_file import write_table
from finlab.bundle_files import LARGEST_BUNDLE
from finlab.errors import FinlabError
from finlab.files.plain_values import yaml_text
from finlab.layout import FinModelSpec, layout_to_dict, load_layout
from finlab.physics import make_law
from webapp.session.files import is_path, read_together
from webapp.tasks.opening import Opening


class Taken:
    """What came to whom, and what the page was told."""

    def __init__(self) -> None:
        """Three takers, two of them for CSV files."""
        self.files: list[tuple[str, str, bytes]] = []
        self.scripts: list[str] = []
        self.refused: list[str] = []
        interface = SimpleNamespace(queue_message=lambda message: self.scripts.append(message.source))
        gui: Any = SimpleNamespace(_websock_interface=interface)
        heard: dict[str, Callable[[str, str], object]] = {}
        presses: Any = SimpleNamespace(on=lambda kind, act: heard.update({kind: self._heard(act)}))
        self.together: list[dict[str, bytes]] = []
        self.opening = Opening(gui, presses, self.together.append)
        self.drop = lambda *told: heard["dropped"]("", json.dumps(told))
        self.tell = lambda text: heard["dropped"]("", text)
        self.opening.add(".csv,.txt", self._taker("fin"))
        self.opening.add(".csv", self._taker("path"), knows=is_path)
        self.opening.add(".yaml,.zip", self._taker("design"))

    def _do(self, act: Callable[[], object]) -> None:
        try:
            act()
        except FinlabError as error:
            self.refused.append(str(error))

    def _heard(self, act: Callable[[str, str], object]) -> Callable[[str, str], object]:
        return lambda key, text: self._do(lambda: act(key, text))

    def _taker(self, who: str) -> Callable[[str, bytes], object]:
        return lambda name, content: self.files.append((who, name, content))


def test_each_file_goes_to_whom_it_is_for() -> None:
    taken = Taken()
    for name, content in (
        ("A.YAML", b"a"),
        ("cell.csv", b"A,f,phi,Fx\n"),
        ("way.csv", b" t, x,y ,z\n0,0,0,0\n"),
    ):
        taken.opening.open(name, content)
    assert [who for who, *_ in taken.files] == ["design", "fin", "path"]
    assert taken.opening.suffixes == ".csv,.txt,.yaml,.zip"


@pytest.mark.parametrize("name", ["notes.docx", "robot", ".yaml", "robot.yaml.exe", ""])
def test_what_cannot_be_opened_is_told_with_what_can(name: str) -> None:
    taken = Taken()
    with pytest.raises(FinlabError, match=r"cannot be opened; expected a design \(YAML, JSON, ZIP\)"):
        taken.opening.open(name, b"")
    taken.drop([name, 1, False])
    assert "cannot be opened" in taken.refused[0] and len(taken.scripts) == 1, "it is not even sent"


def test_folders_and_what_is_too_large_are_not_even_sent() -> None:
    taken = Taken()
    taken.drop(["robots", 0, True])
    taken.drop(["huge.csv", LARGEST_BUNDLE + 1, False])
    taken.drop(*([f"{k}.csv", LARGEST_BUNDLE // 2, False] for k in range(3)))
    taken.drop(*([f"{k}.csv", 1, False] for k in range(1000)))
    assert [text.split(";")[0] for text in taken.refused] == [
        "'robots' is a folder",
        f"huge.csv: has {LARGEST_BUNDLE + 1:,} bytes, expected at most {LARGEST_BUNDLE:,}",
        *taken.refused[2:],
    ]
    assert "expected at most" in taken.refused[2] and "in all" in taken.refused[2]
    assert taken.refused[3].startswith("1000 files were dropped") and len(taken.scripts) == 1


def test_a_design_and_its_table_dropped_at_once_are_one_design(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    grid = [[0.05, 0.6], [0.1, 2.1], [-1.5, 0.0, 1.5]]
    write_table(tmp_path / "soft.csv", make_law(FinModelSpec("soft")), *grid)  # type: ignore[arg-type]
    values = layout_to_dict(load_layout("ucat"))
    values["fins"][0]["model"] = {"type": "table", "path": "tables/soft.csv"}
    taken = Taken()
    taken.drop(["soft.csv", 9, False], ["robot.yaml", 9, False])
    assert taken.scripts[1:] == ["finlabDropping.sendNext();"]
    taken.opening.open("soft.csv", (tmp_path / "soft.csv").read_bytes())
    assert taken.files == [], "the other is still to come"
    assert taken.scripts[1:] == ["finlabDropping.sendNext();"] * 2
    taken.opening.open("robot.yaml", yaml_text(values).encode())
    (parts,) = taken.together
    assert taken.files == [] and set(parts) == {"soft.csv", "robot.yaml"}
    layout = read_together(parts).layout
    assert layout.fins[0].model.type == "table", "found by its name, though its folder was lost"
    taken.opening.open("soft.csv", b"A,f\n")
    assert taken.files[-1][0] == "fin", "later it is a file of its own"


@pytest.mark.parametrize("text", ["", "{", "7", "null", '[["a.csv"]]', '[["a.csv", "1", false]]', "[" * 5000])
def test_nonsense_of_the_page_is_not_heard(text: str) -> None:
    taken = Taken()
    taken.tell(text)
    assert taken.refused == [] and taken.files == []
