"""Training: the loop, its state and its device. It needs PyTorch, as do `finlab.paper.training` and
`finlab.mdn.training`, which say what is learned."""

from finlab.distribution import install
from finlab.errors import DataError

try:
    import torch  # noqa: F401
except ImportError as error:
    raise DataError(
        f"training needs PyTorch, which cannot be imported ({error}); run: {install('train')}"
    ) from error
