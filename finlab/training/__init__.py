"""Training of any network: the loop, its state on disk, its devices and its curves. It needs torch."""
