"""What learns and what measures: networks and their training, methods `paper` and `mdn`,
experiments.

A wing: what allocates names its methods in registries, and imports them when one is asked for.
"""
