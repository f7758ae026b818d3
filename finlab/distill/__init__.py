"""The fast path: a small network learns what the allocator answers after all its searching.

`answers` writes down what the allocator answers, `cost` says what a share of forces costs, `train` fits the
network. What it is used for is in `finlab.allocation.fast`.
"""
