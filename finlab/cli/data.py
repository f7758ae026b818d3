"""`finlab data generate|verify`: forward samples on disk."""

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg
from tyro.extras import SubcommandApp

verbs = SubcommandApp()


@verbs.command
def generate(
    output: Annotated[Path, arg(metavar="FOLDER", aliases=["-o"])] = Path("data/forward"),
    layouts: Annotated[int, arg(metavar="N")] = 1000,
    commands_per_layout: Annotated[int, arg(metavar="N")] = 5000,
    seed: Annotated[int, arg(metavar="N")] = 0,
) -> None:
    """Sample layouts, commands and their wrenches into memory-mapped shards; goes on where it stopped.

    Args:
        output: folder for the shards and their manifest.
        layouts: how many random layouts.
        commands_per_layout: how many random commands on each.
        seed: same numbers and seed, same bytes.
    """
    from finlab.training.data.shards import generate as generate_shards

    report = generate_shards(output, n_layouts=layouts, commands_per_layout=commands_per_layout, seed=seed)
    rate = f", {report.samples_per_second:,.0f} samples/s" if report.samples else ""
    print(f"{report.folder}: {report.samples:,} samples made in {report.seconds:.1f} s{rate}")


@verbs.command
def verify(folder: Annotated[Positional[Path], arg(metavar="FOLDER")]) -> None:
    """Check every file of a data set against its checksum.

    Args:
        folder: folder that `data generate` wrote.
    """
    from finlab.training.data.shards import verify as verify_shards

    print(f"{folder}: {verify_shards(folder):,} samples, all checksums fit")
