"""Layers, weights on disk and normalization of all networks."""
