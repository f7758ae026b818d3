"""Verdicts on printed figures: one function decides from figure, interval and printed value."""

import math
from typing import Any

import pytest

from finlab.research.evaluation.claims import claims, quotient, sentences
from finlab.research.evaluation.experiment import EXPERIMENTS, load_experiment, paper_figures
from finlab.research.evaluation.verdict import Comparison, decide


@pytest.mark.parametrize(
    ("printed", "figure", "interval", "word"),
    [
        (1.0, 1.1, (0.9, 1.3), "reproduced"),
        (1.0, 1.2, (1.15, 1.25), "reproduced"),
        (1.0, 0.81, None, "reproduced"),
        (1.0, 1.26, None, "not"),
        (1.0, 0.79, (0.7, 0.9), "not"),
        (0.40, 3e-4, (1e-4, 5e-4), "not"),
        (1.0, 1.0, (0.4, 2.0), "cannot be decided"),
        (1.0, None, None, "cannot be decided"),
        (1.0, math.nan, None, "cannot be decided"),
        (0.0, 0.0, None, "reproduced"),
        (0.0, 0.1, (0.05, 0.2), "not"),
        (1.0, 0.5, (None, None), "not"),
    ],
)
def test_the_word(printed: float, figure: float | None, interval: Any, word: str) -> None:
    verdict = decide(printed, figure, interval)
    assert verdict.word == word
    assert verdict.reason.endswith(".") and verdict.reason[0].isupper()


@pytest.mark.parametrize("factor", [1e-3, 1.0, 1e4])
def test_units_do_not_matter(factor: float) -> None:
    for printed, figure, low, high in (
        (1.0, 2.0, 1.5, 2.5),
        (1.0, 1.2, 0.9, 1.5),
        (3.0, 3.1, 1, 9),
    ):
        one = decide(printed, figure, (low, high))
        other = decide(factor * printed, factor * figure, (factor * low, factor * high))
        assert one.word == other.word


def test_an_obstacle_decides_nothing_and_is_the_reason() -> None:
    verdict = decide(1.0, 1.0, (0.9, 1.1), "The paper's robot swam in a pool.")
    assert verdict.word == "cannot be decided"
    assert verdict.reason == "The paper's robot swam in a pool."


@pytest.mark.parametrize(
    ("interval", "word"),
    [((1.3, 1.5), "reproduced"), ((1.0, 1.1), "not"), ((1.0, 1.4), "cannot be decided")],
)
def test_a_lower_bound(interval: tuple[float, float], word: str) -> None:
    assert decide(1.25, sum(interval) / 2.0, interval, at_least=True).word == word


def test_the_direction_is_said() -> None:
    assert decide(0.086, 0.020).reason == "Ours is 4.3 times smaller."
    assert decide(0.020, 0.086).reason == "Ours is 4.3 times as large."
    assert decide(0.81, 7e-7).reason == "Ours is 10^6 times smaller."


def test_a_comparison_is_a_row() -> None:
    row = Comparison("id, ours: mean error", 0.086, 0.02, [0.017, 0.023]).row
    assert row["verdict"] == "not" and row["figure_interval"] == [0.017, 0.023]


def test_every_printed_figure_has_its_row() -> None:
    """Those of each table of the paper, whatever was run: without rows none can be decided."""
    compared = {}
    for name in EXPERIMENTS:
        compare = load_experiment(name).compared
        if compare is not None:
            compared[name] = compare([])
    assert all(each.figure is None for some in compared.values() for each in some)
    printed = paper_figures()
    figures = {
        "wrench": [
            v
            for split in printed["wrench_tracking"].values()
            for row in split.values()
            for k, v in row.items()
            if k != "n"
        ],
        "ablation": [v for row in printed["ablation"].values() for v in row.values()],
        "trajectory": [v for row in printed["trajectory"].values() for v in row.values()],
        "velocity": [v for row in printed["velocity"].values() for v in row.values()],
        "faults": [
            v
            for row in printed["fault_tolerance"].values()
            for v in row.get("baseline", {}).values()
        ],
    }
    figures["trajectory"] += [
        v for row in printed["fault_tolerance"].values() for v in row["ours"].values()
    ]
    for name, values in figures.items():
        assert set(values) <= {each.printed for each in compared[name]}, name
        assert len(compared[name]) >= len(values)


ROWS: dict[str, list[dict[str, Any]]] = {
    "wrench": [
        {
            "split": split,
            "method": method,
            "err_norm_mean": value,
            "err_norm_mean_interval": [0.9 * value, 1.1 * value],
        }
        for split in ("id", "ood")
        for method, value in (("paper", 0.02), ("qp", 2.0), ("paper_sqp", 3e-4))
    ],
    "ablation": [
        {
            "variant": variant,
            "scored_by": "plant",
            "j_norm_mean": value,
            "j_norm_mean_interval": [0.9 * value, 1.1 * value],
        }
        for variant, value in (
            ("mean_only", 0.09),
            ("without_refinement", 0.045),
            ("nll_selection", 0.0013),
            ("random_warm_start", 0.0023),
            ("ours", 0.00077),
        )
    ],
    "temperature": [
        {"temperature": t, "best_j_mean": j, "best_j_mean_interval": [0.99 * j, 1.01 * j]}
        for t, j in ((0.001, 0.079), (0.02, 0.078), (10.0, 0.082))
    ],
}
"""Rows of a report, as a referee found them."""


def test_conclusions_are_said_with_the_figures_of_the_rows() -> None:
    said = " ".join(sentences(ROWS))
    for words in (
        "is exact: its mean errors are 0.00030 and 0.00030",
        "the paper prints 0.40 and 0.81",
        "is flat: the mean J goes from 0.078 to 0.082",
        "change places: J_norm is 0.090 for the mixture's mean and 0.045 for the best draw",
        "Ranking by physics is 1.7 times (1.4 to 2.1) better",
        "the paper prints 12",
        "contradict each other",
        "0.017",
        "0.086",
    ):
        assert words in said
    words_of = {each.what: each.verdict.word for each in claims(ROWS)}
    assert words_of["error of the printed SQP over the paper's method, id"] == "not"
    assert words_of["J_norm ranked by likelihood over ranked by physics"] == "not"
    assert words_of["J at the highest temperature, 10, over the least, at least"] == "not"
    wide = [dict(row, best_j_mean_interval=[0.04, 0.16]) for row in ROWS["temperature"]]
    assert "cannot be decided: the mean J goes" in " ".join(sentences({"temperature": wide}))


def test_other_rows_say_otherwise() -> None:
    """No sentence is there because it was expected."""
    other = {
        "wrench": [dict(row, err_norm_mean=0.5) for row in ROWS["wrench"]],
        "ablation": [
            dict(row, j_norm_mean=0.01) if row["variant"] == "mean_only" else row
            for row in ROWS["ablation"]
        ],
        "temperature": [
            dict(ROWS["temperature"][0], best_j_mean=0.3, best_j_mean_interval=[0.29, 0.31]),
            *ROWS["temperature"][1:],
        ],
    }
    said = " ".join(sentences(other))
    assert "does not reach its targets" in said and "is exact" not in said
    assert "as in the paper" in said and "change places" not in said
    assert "No temperature between is clearly best" in said and "flat" not in said
    both = [other["temperature"][0], ROWS["temperature"][1], dict(ROWS["temperature"][2])]
    both[2] |= {"best_j_mean": 0.2, "best_j_mean_interval": [0.19, 0.21]}
    assert "is best, as the paper draws it" in " ".join(sentences({"temperature": both}))


def test_without_rows_nothing_is_said() -> None:
    assert sentences({}) == [] and claims({}) == []


def test_a_quotient_on_the_same_layouts_is_told_from_noise() -> None:
    """Layouts differ tenfold, the two rows by a tenth on each: pairs show it, intervals do not."""
    below = [0.1 * 1.5**k for k in range(8)]
    first = {"split": "id", "x": sum(below), "x_by_layout": below, "x_interval": [0.1, 9.0]}
    above = [1.1 * value for value in below]
    second = {"split": "id", "x": sum(above), "x_by_layout": above, "x_interval": [0.1, 9.0]}
    paired = quotient("x", 1.1, second, first, "x")
    assert paired.interval == pytest.approx([1.1, 1.1])
    other = quotient("x", 1.1, {**second, "split": "ood"}, first, "x")
    assert other.interval == pytest.approx([0.1 / 9.0, 9.0 / 0.1])
    assert quotient("x", 1.1, {}, first, "x").verdict.word == "cannot be decided"
