"""The verbs of `finlab eval`: what is run, its rows and its printed table."""
