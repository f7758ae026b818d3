"""What the network of method `mdn` learns from: torch."""

import finlab.training as _  # noqa: F401
