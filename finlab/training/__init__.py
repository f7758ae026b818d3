"""Training: recipes, losses and the loop."""

from finlab.training.allocator import train_allocator as train_allocator
from finlab.training.presets import PRESETS as PRESETS
from finlab.training.surrogate import train_surrogate as train_surrogate
