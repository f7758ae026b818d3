"""Training of the paper's two networks: forward samples, surrogate, allocator; by torch."""

import finlab.research.training as _  # noqa: F401
