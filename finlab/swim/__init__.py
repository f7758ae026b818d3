"""A robot that swims: its body in water, its hull, what controls it, its simulation, and what a
swim tells.

A wing: nothing that allocates imports it.
"""
