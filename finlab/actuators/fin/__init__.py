"""Flapping fins: laws with a formula, and tables."""
