"""The named recipes: the paper's as printed, ours for method `mdn`."""

import pytest

from finlab.errors import DataError
from finlab.mdn.training.recipes import RECIPES as MDN_RECIPES
from finlab.paper.network import LOG_STD_BOUND
from finlab.paper.training.recipes import RECIPES
from finlab.training.loop import LoopSettings, learning_rate
from finlab.training.recipes import get_recipe


def test_paper_is_as_printed() -> None:
    paper = get_recipe(RECIPES, "paper")
    network, training = paper.network, paper.allocator_training
    assert (network.features, network.joint) == ("raw", False)
    assert (network.width, network.heads) == (128, 4)
    assert (network.graph_layers, network.transformer_layers, network.n_components) == (2, 3, 8)
    assert LOG_STD_BOUND == 3.0
    assert paper.surrogate.hidden[0] == 512
    assert (training.cosine, training.ema) == (False, 0.0)
    assert (training.layouts, training.commands, training.batch_size) == (1000, 5000, 16_384)
    assert training.learning_rate == 1e-4
    assert training.steps * training.batch_size == pytest.approx(575e6, rel=0.01)  # 5 M x 115 epochs
    assert training.guidance_start < training.guidance  # the weight is ramped
    assert training.entropy > 0


def test_ours_ends_in_time_and_holds_a_file_out() -> None:
    for recipe in MDN_RECIPES.values():
        assert recipe.training.seconds is not None and recipe.training.seconds <= 2 * 3600
        assert 2 <= recipe.answers.first <= recipe.answers.shards


def test_an_unknown_recipe_is_refused_with_the_names_that_exist() -> None:
    with pytest.raises(DataError, match="preset: expected one of paper, annealed, smoke, got 'magic'"):
        get_recipe(RECIPES, "magic")


def test_the_learning_rate_rises_and_falls() -> None:
    settings = LoopSettings(steps=1000, batch_size=1, learning_rate=0.1, warmup=10)
    rates = [learning_rate(settings, step) for step in range(1000)]
    assert rates[0] == pytest.approx(0.01, rel=1e-3)
    assert max(rates) == pytest.approx(0.1, rel=1e-2) and rates.index(max(rates)) == 9
    assert rates[9:] == sorted(rates[9:], reverse=True)
    assert rates[-1] == pytest.approx(0.001, rel=1e-2)


def test_a_run_shorter_than_its_warmup_still_reaches_its_peak() -> None:
    settings = LoopSettings(steps=4, batch_size=1, learning_rate=0.1, warmup=100, cosine=False)
    assert [learning_rate(settings, step) for step in range(4)] == pytest.approx([0.025, 0.05, 0.075, 0.1])


def test_the_paper_s_learning_rate_stays() -> None:
    settings = LoopSettings(steps=1000, batch_size=1, learning_rate=1e-4, cosine=False)
    assert {learning_rate(settings, step) for step in (0, 1, 500, 999)} == {1e-4}


def test_a_run_of_limited_time_slows_down_with_it() -> None:
    settings = LoopSettings(steps=1000, batch_size=1, learning_rate=0.1, seconds=50.0)
    rates = [learning_rate(settings, 10, elapsed) for elapsed in (0.0, 25.0, 50.0, 80.0)]
    assert rates[0] == pytest.approx(learning_rate(LoopSettings(1000, 1, 0.1), 10))
    assert rates[1] == pytest.approx(0.1 * 0.505)
    assert rates[2] == rates[3] == pytest.approx(0.001)
