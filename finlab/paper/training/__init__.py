"""Training of the paper's two networks: forward samples, surrogate, allocator; by torch."""

import finlab.training as _  # noqa: F401
