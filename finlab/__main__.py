"""`python -m finlab` is the same as the `finlab` command."""

import sys

from finlab.cli import main

sys.exit(main())
