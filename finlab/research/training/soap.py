"""SOAP: Adam in the eigenbasis of Shampoo's preconditioner (Vyas et al., 2024).

For the gradient G (m, n) of a weight matrix, running means of G G^T and G^T G are kept. Their
eigenvectors Q_L and Q_R turn the gradient, G' = Q_L^T G Q_R, so that its entries are nearly
uncorrelated; Adam then divides each by the root of its own running mean square, and the step is
turned back. On regression without noise, such as the surrogate's, this needs a tenth of the samples
that Adam needs.
"""

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor

MEAN_DECAY = 0.95
"""Decay of the running mean of the gradient, SOAP's beta_1."""
SQUARE_DECAY = 0.95
"""Decay of the running mean of the squared gradient, SOAP's beta_2."""
FACTOR_DECAY = 0.95
"""Decay of the running means of G G^T and G^T G."""
BASIS_EVERY = 10
"""Steps after which the eigenvectors are taken anew, by one step of the power iteration."""
EPSILON = 1e-8
"""Added to the root of the mean square, as by Adam."""


Factors = dict[str, Tensor]
"""Of one weight matrix: `left` (m, m) and `right` (n, n), the running means of G G^T and G^T G, and
their eigenvectors `left_basis` and `right_basis`, the largest first; empty for a vector."""


class Soap(torch.optim.Optimizer):
    """SOAP on one vector of weights; vectors among them, such as biases, are left to Adam."""

    def __init__(self, vector: Tensor, shapes: Sequence[torch.Size], lr: float) -> None:
        """Takes a vector (P,) and the shapes of the weights in it, in their order."""
        super().__init__([vector], {"lr": lr})
        self.vector = vector
        self.shapes = tuple(shapes)
        self.sizes = [shape.numel() for shape in shapes]

    @torch.no_grad()
    def step(self, closure: Any = None) -> None:  # type: ignore[override]
        """Takes a step against the gradient of the vector. The first one only measures."""
        assert closure is None
        assert self.vector.grad is not None
        gradients = self._matrices(self.vector.grad)
        state = self.state[self.vector]
        if not state:
            state["step"] = 0
            state["mean"] = torch.zeros_like(self.vector)
            state["square"] = torch.zeros_like(self.vector)
            state["factors"] = [_first_factors(gradient) for gradient in gradients]
            return
        state["step"] += 1
        count = state["step"]
        state["mean"].lerp_(self.vector.grad, 1.0 - MEAN_DECAY)
        means = self._matrices(state["mean"])
        squares = self._matrices(state["square"])
        weights = self._matrices(self.vector)
        rate = self.param_groups[0]["lr"]
        mean_bias = 1.0 - MEAN_DECAY**count
        square_bias = 1.0 - SQUARE_DECAY**count
        for weight, gradient, mean, square, factors in zip(
            weights, gradients, means, squares, state["factors"], strict=True
        ):
            turned_gradient = _turned(gradient, factors)
            turned_mean = _turned(mean, factors)
            square.mul_(SQUARE_DECAY)
            square.addcmul_(turned_gradient, turned_gradient, value=1.0 - SQUARE_DECAY)
            root = (square / square_bias).sqrt_().add_(EPSILON)
            change = _turned_back(turned_mean / mean_bias / root, factors)
            weight.sub_(change, alpha=rate)
            if factors:
                _update(factors, gradient, square, renew=count % BASIS_EVERY == 0)

    def _matrices(self, vector: Tensor) -> list[Tensor]:
        """Views of the weights' parts of a vector."""
        parts = vector.split(self.sizes)
        return [part.view(shape) for part, shape in zip(parts, self.shapes, strict=True)]


def _first_factors(gradient: Tensor) -> Factors:
    """The factors after the first gradient."""
    if gradient.ndim != 2:
        return {}
    left = gradient @ gradient.T
    right = gradient.T @ gradient
    return {
        "left": left,
        "right": right,
        "left_basis": torch.linalg.eigh(left)[1].flip(1).contiguous(),
        "right_basis": torch.linalg.eigh(right)[1].flip(1).contiguous(),
    }


def _turned(matrix: Tensor, factors: Factors) -> Tensor:
    """Q_L^T M Q_R."""
    if not factors:
        return matrix
    return factors["left_basis"].T @ matrix @ factors["right_basis"]


def _turned_back(matrix: Tensor, factors: Factors) -> Tensor:
    """Q_L M Q_R^T."""
    if not factors:
        return matrix
    return factors["left_basis"] @ matrix @ factors["right_basis"].T


def _update(factors: Factors, gradient: Tensor, square: Tensor, renew: bool) -> None:
    """Adds a gradient to the factors; where `renew`, their eigenvectors follow, and the mean
    squares, which belong to these, are put in the same order."""
    factors["left"].lerp_(gradient @ gradient.T, 1.0 - FACTOR_DECAY)
    factors["right"].lerp_(gradient.T @ gradient, 1.0 - FACTOR_DECAY)
    if not renew:
        return
    rows = _renewed_basis(factors, "left")
    columns = _renewed_basis(factors, "right")
    square.copy_(square[rows][:, columns])


def _renewed_basis(factors: Factors, side: str) -> Tensor:
    """Takes one step of the orthogonal iteration to a basis, largest eigenvalue first, and returns
    the order that its columns had before."""
    factor = factors[side]
    basis = factors[f"{side}_basis"]
    product = factor @ basis
    rayleigh = (basis * product).sum(0)
    order = rayleigh.argsort(descending=True, stable=True)
    factors[f"{side}_basis"] = torch.linalg.qr(product[:, order])[0].contiguous()
    return order
