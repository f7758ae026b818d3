"""What the paper's network sees: the same in both libraries, fins in any order, and as documented."""

import math

import numpy as np
import torch

from finlab.inference.features import RAW_SIZE, raw_features
from finlab.layout import Fin, Layout, Limits, random_layouts, stack_layouts


def test_numpy_and_torch_agree_and_fins_may_come_in_any_order() -> None:
    arrays = random_layouts(np.random.default_rng(3), 8, limits="mixed")
    features = raw_features(*arrays[:4])
    assert features.shape == (8, 5, RAW_SIZE)
    tensors = [torch.from_numpy(value) for value in arrays]
    np.testing.assert_allclose(raw_features(*tensors[:4]).numpy(), features, rtol=1e-12)
    order = [3, 0, 4, 2, 1]
    shuffled = [value[:, order] for value in arrays[:4]]
    np.testing.assert_array_equal(raw_features(*shuffled), features[:, order])


def test_documented_meaning_of_the_raw_features() -> None:
    layout = Layout(
        "one", (Fin("bow", (0.3, -0.15, 0.06), math.pi / 2, Limits((0.06, 0.3), (0.21, 2.1), (-1.0, 2.0))),)
    )
    arrays = stack_layouts([layout])
    expected = [1.0, -0.5, 0.2, 0.5, 0.1, 0.5, 0.1, 1.0, -1.0 / math.pi, 2.0 / math.pi]
    np.testing.assert_allclose(raw_features(*arrays[:4])[0, 0], expected)
