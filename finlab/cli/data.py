"""`finlab data generate`: forward samples on disk."""

from pathlib import Path
from typing import Annotated

from tyro.conf import arg
from tyro.extras import SubcommandApp

verbs = SubcommandApp()


@verbs.command
def generate(
    output: Annotated[Path, arg(metavar="FOLDER", aliases=["-o"])] = Path("data/forward"),
    layouts: Annotated[int, arg(metavar="N")] = 1000,
    commands_per_layout: Annotated[int, arg(metavar="N")] = 5000,
    seed: Annotated[int, arg(metavar="N")] = 0,
) -> None:
    """Sample layouts, commands and their wrenches into memory-mapped shards; continues where it stopped.

    Args:
        output: folder for the shards and their manifest.
        layouts: how many random layouts.
        commands_per_layout: how many random commands on each.
        seed: same numbers and seed, same bytes.
    """
    from finlab.data.shards import generate as generate_shards

    generate_shards(output, n_layouts=layouts, commands_per_layout=commands_per_layout, seed=seed)
