"""The named recipes: the paper's as printed, ours with what it is meant to change."""

import pytest

from finlab.errors import DataError
from finlab.inference.features import SIZES
from finlab.inference.mixture import LOG_STD_BOUND
from finlab.training.loop import LoopSettings, learning_rate
from finlab.training.networks.allocator_network import AllocatorNetwork
from finlab.training.networks.surrogate import make_surrogate
from finlab.training.presets import PRESETS, get_preset


def test_paper_is_as_printed() -> None:
    paper = get_preset("paper")
    network, training = paper.network, paper.allocator_training
    assert (network.features, SIZES[network.features], network.joint) == ("raw", 10, False)
    assert (network.width, network.heads) == (128, 4)
    assert (network.graph_layers, network.transformer_layers, network.n_components) == (2, 3, 8)
    assert LOG_STD_BOUND == 3.0
    assert (paper.surrogate.kind, paper.surrogate.hidden[0]) == ("mlp", 512)
    assert (training.guide, training.imitate, training.cosine, training.ema) == ("samples", "all", False, 0.0)
    assert training.steps * training.batch_size == pytest.approx(575e6, rel=0.01)  # 5 M x 115 epochs
    assert training.guidance_start < training.guidance  # the weight is ramped
    assert training.imitation > 0 and training.entropy > 0


def test_default_differs_where_it_should() -> None:
    default = get_preset("default")
    assert (default.network.features, default.network.joint) == ("fin_frame", True)
    assert default.surrogate.kind == "coefficient"
    assert default.network.graph_layers > 0 and default.network.transformer_layers > 0


@pytest.mark.parametrize("name", list(PRESETS))
def test_every_recipe_can_be_built(name: str) -> None:
    preset = get_preset(name)
    assert preset.name == name
    network = AllocatorNetwork(preset.network, SIZES[preset.network.features])
    per_fin = 7 if preset.network.joint else 6
    assert network.head.out_features == per_fin * preset.network.n_components
    assert sum(parameter.numel() for parameter in make_surrogate(preset.surrogate).parameters()) > 0


def test_an_unknown_recipe_is_refused_with_the_names_that_exist() -> None:
    with pytest.raises(DataError, match="preset: expected one of default, paper, smoke, got 'magic'"):
        get_preset("magic")


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
