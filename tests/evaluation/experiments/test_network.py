"""What the network buys, at a tiny size: each row begins where it says, and is compared with all."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finlab.allocation import load_allocator
from finlab.cli import main
from finlab.evaluation.experiments import network
from finlab.evaluation.experiments.network import STARTS, network_rows
from finlab.evaluation.report.sections.network import network_blocks
from finlab.evaluation.report.text import to_text
from finlab.layout import random_layout

SMALL: dict[str, Any] = {"layouts": 2, "targets": 3, "seed": 1}


@pytest.mark.parametrize("objective", ["power", "effort"])
def test_rows_compare_what_each_start_leads_to(objective: Any) -> None:
    rows = network_rows(load_allocator("mdn"), [4, 6], objective, **SMALL)
    assert [(row["fins"], row["seeds"]) for row in rows] == [(n, name) for n in (4, 6) for name in STARTS]
    for row in rows:
        assert row["n"] == 6 and row["objective"] == objective and row["ms"] > 0.0
        assert row["tracked"] == 1.0 and row["error_max"] < 1e-4
        low, high = row["cost_ratio_interval"]
        assert 0.9 < low <= row["cost_ratio"] <= high < 1.5
        if row["seeds"] == "all":
            assert row["cost_ratio"] == 1.0 and row["dearer"] == 0.0
        if objective == "power":
            assert row["cost_ratio"] == pytest.approx(1.0, abs=1e-3)
    text = to_text(*network_blocks(rows, 8)).replace("\n", " ")
    assert all(f"`{name}`: " in text for name in STARTS) and "8 seeds where there are several" in text


def test_seeds_are_as_many_and_what_they_are_called() -> None:
    method = load_allocator("mdn", objective="effort", n_candidates=5)
    layout = random_layout(np.random.default_rng(0), n_fins=6)
    prepared, rng = method.pipeline.prepare(layout), np.random.default_rng(1)
    found = {name: network._seeds(method, prepared, np.ones((1, 6)), name, rng) for name in STARTS}
    assert found["all"] is None
    sizes = {name: seeds.shape for name, seeds in found.items() if seeds is not None}
    assert sizes == {
        "network": (1, 5, 2, 6),
        "random": (1, 5, 6),
        "sub-layouts": (1, 5, 6),
        "one": (1, 1, 6),
    }
    maximum = prepared.planar.fins.maximum
    np.testing.assert_array_equal(found["one"][0, 0], maximum)  # type: ignore[index]
    rests = found["sub-layouts"][0] / maximum  # type: ignore[index]
    assert set(np.unique(rests.round(6))) <= {0.001, 1.0}
    assert len({row.tobytes() for row in rests}) == 5


def test_the_verb_prints_and_writes_the_rows(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "rows.json"
    command = ["eval", "network", "--fins", "4", "--layouts", "1", "--targets", "2", "--candidates", "3"]
    assert main([*command, "--objectives", "effort", "--json", str(file)]) == 0
    assert "3 seeds where there are several" in capsys.readouterr().out.replace("\n", " ")
    assert '"sub-layouts"' in file.read_text()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--fins", "4,x"], "fins: expected numbers from 1 to 16 with commas between, got 'x'"),
        (["--fins", "17"], "fins: expected numbers from 1 to 16"),
        (["--layouts", "0"], "layouts: expected a number of at least 1"),
        (["--objectives", "speed"], "objectives: expected power, effort or both"),
    ],
)
def test_bad_input_is_one_sentence(
    options: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["eval", "network", *options]) == 2
    err = capsys.readouterr().err
    assert message in err and len(err.splitlines()) == 1
