"""Convex sets of what actuators can push, and how these add up. numpy and scipy."""
