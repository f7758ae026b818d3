"""Seeded test splits, error measures and side-by-side comparisons of allocation methods."""
