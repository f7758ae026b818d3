"""Training of the network of method `mdn`, by torch."""

import finlab.training as _  # noqa: F401
