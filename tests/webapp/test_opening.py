"""Files that a browser sends, whatever they are: each is opened by its kind, or a sentence says why not."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from finlab.errors import FinlabError
from webapp.tasks.designs import Opening


class Taken:
    """What came to whom."""

    def __init__(self) -> None:
        """Two takers."""
        self.files: list[tuple[str, str, bytes]] = []
        interface = SimpleNamespace(queue_message=lambda message: None)
        gui: Any = SimpleNamespace(_websock_interface=interface)
        self.heard: dict[str, Callable[[str, str], object]] = {}
        presses: Any = SimpleNamespace(on=lambda kind, act: self.heard.update({kind: act}))
        self.opening = Opening(gui, presses)
        self.opening.add(".csv,.txt", self._taker("fin"))
        self.opening.add(".yaml,.zip", self._taker("design"))

    def _taker(self, who: str) -> Callable[[str, bytes], object]:
        return lambda name, content: self.files.append((who, name, content))


def test_each_file_goes_to_whom_it_is_for() -> None:
    taken = Taken()
    for name, content in (("A.YAML", b"a"), ("cell.csv", b"A,f,phi,Fx\n")):
        taken.opening.open(name, content)
    assert [who for who, *_ in taken.files] == ["design", "fin"]
    assert taken.opening.suffixes == ".csv,.txt,.yaml,.zip"


@pytest.mark.parametrize("name", ["notes.docx", "robot", ".yaml", "robot.yaml.exe", ""])
def test_what_cannot_be_opened_is_told_with_what_can(name: str) -> None:
    with pytest.raises(FinlabError, match=r"cannot be opened; expected a design \(YAML, JSON, ZIP\)"):
        Taken().opening.open(name, b"")


def test_several_files_at_once_are_refused() -> None:
    with pytest.raises(FinlabError, match="one ZIP archive"):
        Taken().heard["dropped"]("", "")
