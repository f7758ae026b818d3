"""`finlab train mdn`: train the network of method `mdn`."""

from pathlib import Path
from typing import Annotated

from tyro.conf import arg
from tyro.extras import SubcommandApp

from finlab.cli.inputs import check_positive

verbs = SubcommandApp()

_Count = Annotated[int | None, arg(metavar="N")]


@verbs.command
def mdn(
    output: Annotated[Path, arg(metavar="FOLDER", aliases=["-o"])],
    preset: Annotated[str, arg(metavar="NAME")] = "default",
    seed: Annotated[int, arg(metavar="N")] = 0,
    minutes: _Count = None,
    steps: _Count = None,
) -> None:
    """Train the network of method `mdn` on what many starts find, and write a checkpoint folder.

    The answers are written first, on all cores; a later run into the same folder finds them.

    Args:
        output: folder for checkpoint, answers and log.
        preset: recipe: default or smoke.
        seed: seed of the answers and of the first weights.
        minutes: time after which the learning ends, instead of the recipe's.
        steps: most optimizer steps instead of the recipe's.
    """
    from finlab.mdn.training.train import train_mdn

    check_positive(minutes=minutes, steps=steps)
    seconds = None if minutes is None else 60.0 * minutes
    made = train_mdn(preset, output, seed=seed, steps=steps, seconds=seconds)
    print(f"{output}: checkpoint {made.name}, preset {made.preset}, sha256 {made.sha256}")
    for group, values in made.metrics.items():
        for name, value in values.items():
            print(f"{group} {name} {value:.3g}")
