"""`finlab train surrogate|allocator`: train the two networks of a checkpoint."""

from pathlib import Path
from typing import Annotated

from tyro.conf import arg
from tyro.extras import SubcommandApp

verbs = SubcommandApp()
