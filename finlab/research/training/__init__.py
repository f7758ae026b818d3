"""Training of any network: the loop, its state on disk, its devices and its curves. It needs
torch."""

import os

# Threads of torch that wait for each other by spinning halt a training tenfold where another
# process is busy. Read when torch is loaded, so each package that trains imports this one first.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
