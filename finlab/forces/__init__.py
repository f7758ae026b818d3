"""Convex sets of feasible forces, and the attainable wrenches that are their sums."""
