"""The comparison of an allocator's modes with those of random starts."""

import numpy as np
import pytest

from finlab.allocation.modes import mode_signature
from finlab.cli import main
from finlab.evaluation.experiments.mode_coverage import _covered, _energy_distance

PUSH, REST = (0.4, 1.5, 0.0), (0.05, 0.1, 0.0)


def test_coverage_counts_ways_that_are_the_same() -> None:
    one = mode_signature(np.array([PUSH, REST]), np.array([1.0, 0.0]))
    other = mode_signature(np.array([REST, PUSH]), np.array([0.0, 1.0]))
    assert _covered([one, other], [one]) == 0.5
    assert _covered([], [one]) == 1.0 and _covered([one], []) == 0.0


def test_energy_distance_tells_sets_apart() -> None:
    rng = np.random.default_rng(0)
    near, far = rng.normal(size=(40, 3)), rng.normal(size=(40, 3)) + 50.0
    assert _energy_distance(near, near) == pytest.approx(0.0, abs=1e-12)
    assert _energy_distance(near, far) > 0.5
    assert _energy_distance(near, np.empty((0, 3))) == 0.0


def test_the_verb_prints_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["eval", "modes", "--layouts", "2", "--targets", "1", "--starts", "8", "--seed", "5000"]) == 0
    printed = capsys.readouterr().out.replace("\n", " ")
    assert "found by the starts" in printed and "8 random starts of IPOPT" in printed
