"""Methods as users name them."""

import pytest

from finlab.errors import AllocationError
from finlab.evaluation.method_specs import load_method_specs


def test_methods_that_cannot_choose_are_left_as_they_are() -> None:
    methods = load_method_specs(["paper", "analytic", "sqp"], objective="effort")
    assert list(methods) == ["paper", "analytic", "sqp"]
    assert vars(methods["sqp"].choice.settings)["objective"] == "effort"


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ("dual,fast", "method: expected one of dual, .* got 'fast'"),
        ("dual-32", "method: expected one of dual, .* got 'dual-32'"),
        ("sqp-money", "method: expected one of dual, mdn"),
    ],
)
def test_names_that_are_none(names: str, message: str) -> None:
    with pytest.raises(AllocationError, match=message):
        load_method_specs(names.split(","))
