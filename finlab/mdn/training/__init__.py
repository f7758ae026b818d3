"""What the network of method `mdn` learns from: torch."""
