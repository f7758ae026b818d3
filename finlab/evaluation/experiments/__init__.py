"""One file for each verb of `finlab eval`: what is run, its rows and its printed table."""
