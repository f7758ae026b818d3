"""From measurements to models: a fin from a load cell, a robot from a swim.

Nothing here knows the truth that `finlab.sim` swims in; what is fitted comes from data alone.
"""
