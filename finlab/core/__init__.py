"""The dual allocator's core in C, and its calls."""
