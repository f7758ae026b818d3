"""Interactions learned from forward data: samples, constants of the formula, networks."""
