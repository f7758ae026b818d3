"""What the learned allocator needs of a checkpoint, as numpy arrays: no tensor library from here on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from numpy.typing import NDArray

from finlab.errors import CheckpointError
from finlab.inference.fast_weights import FastWeights
from finlab.inference.normalization import Normalization

if TYPE_CHECKING:
    from finlab.training.networks.checkpoint import Checkpoint

Array = NDArray[Any]


class LearnedWeights(NamedTuple):
    """Trained weights and what they were trained for; a checkpoint or a deployment bundle gives them."""

    checkpoint: str
    """Name of the checkpoint they come from."""
    network: Mapping[str, Array]
    """State of the allocator network, by PyTorch's names."""
    heads: int
    """Attention heads of the network."""
    n_components: int
    """Number M of mixture components."""
    surrogate: Mapping[str, Array]
    """State of the surrogate's perceptron, `net.<i>.weight` and `net.<i>.bias`."""
    reference: tuple[float, float]
    """Amplitude [rad] and frequency [Hz] at which the surrogate's inputs are one."""
    force_unit: float
    """Force [N] of a coefficient of one."""
    normalization: Normalization
    """Per-axis statistics of the wrench."""
    fin_model: Mapping[str, Any]
    """Fin model that the surrogate learned, as in a layout file."""
    fast: FastWeights | None = None
    """The distilled network of the fast path, where one was trained."""


def weights_of(checkpoint: Checkpoint) -> LearnedWeights:
    """The weights of a loaded checkpoint.

    Raises:
        CheckpointError: the surrogate or the network is not of the kind that `learned` works with.
    """
    from finlab.training.networks.surrogate import FORCE_UNIT, CoefficientSurrogate  # torch is there already

    if not isinstance(checkpoint.surrogate, CoefficientSurrogate):
        raise CheckpointError(
            f"checkpoint {checkpoint.name!r}: method `learned` needs a surrogate of kind `coefficient`, "
            f"got {checkpoint.surrogate.config.kind!r}; use method `paper` with this checkpoint"
        )
    network = checkpoint.network
    if network is None or not network.config.joint:
        raise CheckpointError(
            f"checkpoint {checkpoint.name!r}: method `learned` needs a joint-mixture network"
        )
    return LearnedWeights(
        checkpoint.name,
        {key: value.numpy() for key, value in network.state_dict().items()},
        network.config.heads,
        network.config.n_components,
        {key: value.numpy() for key, value in checkpoint.surrogate.state_dict().items()},
        CoefficientSurrogate.REFERENCE,
        FORCE_UNIT,
        checkpoint.normalization,
        checkpoint.fin_model,
        checkpoint.fast,
    )
