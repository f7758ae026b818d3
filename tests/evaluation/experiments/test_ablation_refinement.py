"""The Levenberg-Marquardt refinement of the paper's pipeline."""

from pathlib import Path

import numpy as np
import pytest

from finlab.errors import AllocationError
from finlab.evaluation.experiments.ablation import ablation_method
from finlab.evaluation.splits import make_split


def test_it_starts_where_adam_starts_and_never_makes_worse(untrained_checkpoint: Path) -> None:
    case = make_split("limits", 3, 6, 4)[2]
    options = {"checkpoint": untrained_checkpoint, "n_candidates": 8}
    raw = ablation_method("without_refinement", "levenberg-marquardt", **options)
    adam, refined = (ablation_method("ours", name, **options) for name in ("adam", "levenberg-marquardt"))
    errors = []
    for method in (raw, adam, refined):
        answer = method.allocate_batch(case.layout, case.targets, seed=1)
        lower, upper = (
            np.array([getattr(fin.limits, end) for fin in case.layout.fins]) for end in ("lower", "upper")
        )
        assert (answer.command >= lower).all() and (answer.command <= upper).all()
        errors.append(method.normalization.error(answer.wrench_surrogate, case.targets))
    before, by_adam, after = errors
    assert (after <= before + 1e-5).all()
    # An untrained surrogate hardly answers to commands, and steps end at the limits.
    assert after.mean() < 0.9 * before.mean() and after.mean() < 1.5 * by_adam.mean()


def test_unknown_refinement() -> None:
    with pytest.raises(
        AllocationError, match="refinement: expected one of none, adam, levenberg-marquardt, got 'newton'"
    ):
        ablation_method("ours", "newton")
