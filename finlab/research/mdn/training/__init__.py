"""Training of the network of method `mdn`, by torch."""

import finlab.research.training as _  # noqa: F401
