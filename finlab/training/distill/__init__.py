"""The fast path: a small network learns what the allocator answers after all its searching."""
