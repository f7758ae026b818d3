"""How the paper's two networks are trained: forward samples, surrogate, allocator. It needs torch."""

import finlab.training as _  # noqa: F401
