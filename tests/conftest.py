"""Settings that all tests share."""

from hypothesis import settings

# Machines that run tests also run browsers and trainings: an example that takes long is no failure.
settings.register_profile("finlab", deadline=None)
settings.load_profile("finlab")
