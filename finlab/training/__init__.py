"""Training: recipes, losses and the loop. The one room that needs PyTorch."""

from finlab.distribution import install
from finlab.errors import DataError

try:
    import torch  # noqa: F401
except ImportError as error:
    raise DataError(
        f"training needs PyTorch, which cannot be imported ({error}); run: {install('train')}"
    ) from error

from finlab.training.allocator import train_allocator as train_allocator
from finlab.training.mdn.train import train_mdn as train_mdn
from finlab.training.surrogate import train_surrogate as train_surrogate
