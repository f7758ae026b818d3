"""The page *In your control loop* runs as it stands."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finlab
from finlab.allocation import Allocator

PAGE = Path(__file__).resolve().parents[2] / "docs" / "howto" / "control-loop.md"
"""The page whose blocks are run."""


def test_the_page_runs_and_its_thousand_ticks_stay_within_the_drives(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = PAGE.read_text()
    assert len(text.splitlines()) <= 100, "the page is read in a sitting"
    blocks = re.findall(r"^```python[^\n]*\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    answers: list[Any] = []
    plain = Allocator.allocate

    def kept(self: Allocator, *arguments: Any, **options: Any) -> Any:
        answer = plain(self, *arguments, **options)
        answers.append((answer, options))
        return answer

    monkeypatch.setattr(Allocator, "allocate", kept)
    names: dict[str, Any] = {}
    for block in blocks:
        exec(compile(block, str(PAGE), "exec"), names)
    assert "names free" not in capsys.readouterr().err
    layout = finlab.load_layout("catamaran")
    lower = layout.lower
    upper = layout.upper
    step = layout.rates * 0.1
    ticks = [one for one in answers if isinstance(one[1].get("previous"), type(answers[0][0]))]
    assert len(ticks) > 1000
    assert any(not answer.reachable for answer, _ in ticks) and ticks[-1][0].damage.lost == ("bow",)
    for answer, options in ticks:
        command = answer.command
        before = options["previous"].command
        known = np.isfinite(command)
        assert (command[known] >= lower[known]).all() and (command[known] <= upper[known]).all()
        change = np.abs(command - before)
        change[:2, 0] = np.minimum(change[:2, 0], 2.0 * np.pi - change[:2, 0])
        compared = np.isfinite(change) & np.isfinite(step)
        assert (change[compared] <= step[compared] * (1.0 + 1e-9)).all()
