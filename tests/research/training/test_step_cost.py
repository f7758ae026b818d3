"""The cost of a training step: every product is counted, with the shapes it has in the step."""

from pathlib import Path

import torch

from finlab.research.paper.training.training_costs import training_costs
from finlab.research.training.step_cost import step_cost


def test_products_of_a_layer_are_one_forward_and_one_for_each_gradient() -> None:
    weight = torch.randn(7, 5, requires_grad=True)
    bias = torch.zeros(7, requires_grad=True)
    x = torch.randn(64, 5, requires_grad=True)
    before = torch.get_num_threads()

    def step(number: int) -> None:
        loss = torch.nn.functional.linear(x, weight, bias).square().sum()
        torch.autograd.grad(loss, [weight, bias, x])

    cost = step_cost(step, samples=64, steps=5)
    assert (cost.products, cost.flops) == (3, 3 * 2 * 64 * 5 * 7)
    assert 0.0 < cost.products_s < cost.step_s <= cost.median_s
    assert cost.ratio == cost.step_s / cost.products_s
    assert cost.samples_per_second == 64 / cost.step_s
    assert torch.get_num_threads() == before


def test_a_step_of_the_surrogate_costs_few_times_its_products(tmp_path: Path) -> None:
    costs = training_costs("smoke", tmp_path, steps=10)
    assert costs["surrogate"].samples == 256
    # Six layers, four of the perceptron, the descriptor's and the affine one: each has a product
    # forward and one for the gradient by its weights, but the two at the inputs have none by those.
    assert costs["surrogate"].products == 6 + 6 + 4
    assert costs["surrogate"].ratio < 15.0
    assert costs["allocator"].ratio < 15.0
