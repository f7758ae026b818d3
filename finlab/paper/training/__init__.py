"""What the paper's surrogate and network learn from, and by which losses: torch."""
