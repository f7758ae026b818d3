"""The distilled network in numpy against the trained one."""

import numpy as np
import pytest
import torch

from finlab.inference.fast_network import FastWeights, NumpyFastNetwork
from finlab.training.distill.network import FastConfig, FastNetwork


@pytest.mark.parametrize("n_fins", [1, 4, 7])
def test_numpy_answers_as_torch(n_fins: int) -> None:
    torch.manual_seed(0)
    network = FastNetwork(FastConfig(width=32, rounds=2), 25)
    state = {key: value.detach().numpy() for key, value in network.named_parameters()}
    x = np.random.default_rng(0).normal(size=(5, n_fins, 25)).astype(np.float32)
    with torch.inference_mode():
        truth = network(torch.tensor(x), torch.ones(5, n_fins)).numpy()
        wider = torch.nn.functional.pad(torch.tensor(x), (0, 0, 0, 2))
        mask = torch.tensor([[1.0] * n_fins + [0.0] * 2] * 5)
        padded = network(wider, mask).numpy()[:, :n_fins]
    np.testing.assert_allclose(NumpyFastNetwork(FastWeights(state, 2))(x), truth, atol=1e-5)
    np.testing.assert_allclose(padded, truth, atol=1e-5)


def test_huge_inputs_are_no_warning(recwarn: pytest.WarningsRecorder) -> None:
    network = FastNetwork(FastConfig(width=32, rounds=2), 25)
    state = {key: value.detach().numpy() for key, value in network.named_parameters()}
    x = np.array([1e6, -1e6], dtype=np.float32)[:, None, None] * np.ones((2, 3, 25), dtype=np.float32)
    share = NumpyFastNetwork(FastWeights(state, 2))(x)
    assert ((share >= 0.0) & (share <= 1.0)).all()
    assert not recwarn.list
