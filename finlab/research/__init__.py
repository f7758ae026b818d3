"""Research: networks and their training, the learned methods `paper` and `mdn`, and experiments.

A wing: what allocates names its methods in registries, and imports them when one is asked for.
"""
