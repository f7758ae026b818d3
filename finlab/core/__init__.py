"""Hot loops in C, and the way to them from Python."""
