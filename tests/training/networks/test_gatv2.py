"""The dense GATv2 layer against PyTorch Geometric's, on complete graphs, with and without padding."""

import pytest
import torch
from torch import Tensor
from torch_geometric.nn import GATv2Conv

from finlab.training.networks.allocator_network import DenseGATv2

HEADS, WIDTH, FEATURES = 4, 32, 10


def make_pair() -> tuple[DenseGATv2, GATv2Conv]:
    """The two layers with the same random weights, biases included."""
    torch.manual_seed(3)
    dense = DenseGATv2(FEATURES, WIDTH, HEADS)
    torch.nn.init.normal_(dense.bias)
    reference = GATv2Conv(FEATURES, WIDTH // HEADS, heads=HEADS)
    with torch.no_grad():
        for ours, theirs in ((dense.source, reference.lin_l), (dense.target, reference.lin_r)):
            theirs.weight.copy_(ours.weight)
            theirs.bias.copy_(ours.bias)
        reference.att.copy_(dense.attention[None])
        reference.bias.copy_(dense.bias)
    return dense, reference


def complete_graph(n: int) -> Tensor:
    """Edges (2, n (n - 1)) between all pairs; the reference adds the self loops."""
    return torch.tensor([(i, j) for i in range(n) for j in range(n) if i != j]).T


@pytest.mark.parametrize("n", range(2, 9))
def test_equals_the_reference_on_complete_graphs(n: int) -> None:
    dense, reference = make_pair()
    x = torch.randn(5, n, FEATURES)
    out = dense(x)
    for graph in range(5):
        expected = reference(x[graph], complete_graph(n))
        torch.testing.assert_close(out[graph], expected, atol=1e-5, rtol=0.0)


@pytest.mark.parametrize("n", range(2, 9))
def test_a_padded_graph_equals_the_reference_without_padding(n: int) -> None:
    dense, reference = make_pair()
    x = torch.randn(3, 10, FEATURES) * 5.0  # what stands in the padding is no zero
    mask = torch.arange(10).expand(3, -1) < n
    out = dense(x, mask)
    for graph in range(3):
        expected = reference(x[graph, :n], complete_graph(n))
        torch.testing.assert_close(out[graph, :n], expected, atol=1e-5, rtol=0.0)


def test_gradients_agree_with_differences() -> None:
    layer = DenseGATv2(3, 4, 2).double()
    x = torch.randn(2, 3, 3, dtype=torch.float64, requires_grad=True)
    mask = torch.tensor([[True, True, False], [True, True, True]])
    assert torch.autograd.gradcheck(lambda features: layer(features, mask), x)


def test_refuses_a_width_that_does_not_divide_among_the_heads() -> None:
    with pytest.raises(ValueError, match="out_features 10 must be a multiple of heads 4"):
        DenseGATv2(3, 10, 4)
