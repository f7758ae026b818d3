"""`finlab train mdn|surrogate|allocator`: train the networks of a checkpoint.

All go on from the last saved state when they are called again with the same arguments. `mdn` is the network
of the method of that name; `surrogate` and `allocator` are the paper's.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import arg
from tyro.extras import SubcommandApp

from finlab.cli.inputs import check_positive

if TYPE_CHECKING:
    from finlab.networks.trained import TrainedWeights

verbs = SubcommandApp()

_Preset = Annotated[str, arg(metavar="NAME")]
_Output = Annotated[Path, arg(metavar="FOLDER", aliases=["-o"])]
_Count = Annotated[int | None, arg(metavar="N")]


@verbs.command
def mdn(
    output: _Output,
    preset: _Preset = "default",
    seed: Annotated[int, arg(metavar="N")] = 0,
    minutes: _Count = None,
    steps: _Count = None,
    stop_after: _Count = None,
) -> None:
    """Train the network of method `mdn` on what many starts find, and write a checkpoint folder.

    One process writes the answers, another learns from them: two cores are busy.

    Args:
        output: folder for checkpoint, answers, log and resume state.
        preset: recipe: default or smoke.
        seed: seed of the answers and of the first weights.
        minutes: time after which the training ends, instead of the recipe's.
        steps: most optimizer steps instead of the recipe's.
        stop_after: stop after so many steps; call again to go on.
    """
    from finlab.mdn.training.train import train_mdn

    check_positive(minutes=minutes)
    seconds = None if minutes is None else 60.0 * minutes
    _train(train_mdn, preset, output, {"steps": steps, "stop_after": stop_after}, seed=seed, seconds=seconds)


@verbs.command
def surrogate(
    output: _Output,
    preset: _Preset = "paper",
    seed: Annotated[int, arg(metavar="N")] = 0,
    steps: _Count = None,
    stop_after: _Count = None,
    fin_model: Annotated[str, arg(metavar="NAME|FILE.csv")] = "drag",
) -> None:
    """Train the paper's learned fin physics and write a checkpoint folder with it alone.

    Args:
        output: folder for checkpoint, log and resume state.
        preset: recipe: paper or smoke.
        seed: seed of the data and of the first weights.
        steps: optimizer steps instead of the recipe's.
        stop_after: stop after so many steps; call again to go on.
        fin_model: what to learn: drag, lighthill, or a table of measured forces.
    """
    from finlab.layout import FinModelSpec
    from finlab.paper.training.surrogate import train_surrogate

    table = (("path", str(Path(fin_model).resolve())),)
    spec = FinModelSpec("table", table) if fin_model.lower().endswith(".csv") else FinModelSpec(fin_model)
    counts = {"steps": steps, "stop_after": stop_after}
    _train(train_surrogate, preset, output, counts, seed=seed, fin_model=spec)


@verbs.command
def allocator(
    output: _Output,
    surrogate: Annotated[Path, arg(metavar="NAME|FOLDER")],
    preset: _Preset = "paper",
    start: Annotated[Path | None, arg(metavar="NAME|FOLDER")] = None,
    seed: Annotated[int, arg(metavar="N")] = 0,
    steps: _Count = None,
    layouts: _Count = None,
    commands: _Count = None,
    stop_after: _Count = None,
) -> None:
    """Train the paper's network on a trained surrogate and write a whole checkpoint folder.

    Args:
        output: folder for checkpoint, log and resume state.
        surrogate: checkpoint whose surrogate guides the training.
        preset: recipe: paper, annealed (to go on from a trained network) or smoke.
        start: checkpoint whose network the training begins with, instead of random weights.
        seed: seed of the data and of the first weights.
        steps: optimizer steps instead of the recipe's.
        layouts: random layouts of the data set instead of the recipe's.
        commands: random commands on each of them instead of the recipe's.
        stop_after: stop after so many steps; call again to go on.
    """
    from finlab.paper.training.network import train_allocator

    counts = {"steps": steps, "layouts": layouts, "commands": commands, "stop_after": stop_after}
    _train(train_allocator, preset, output, counts, surrogate=surrogate, start=start, seed=seed)


def _train(
    train: Callable[..., TrainedWeights],
    preset: str,
    output: Path,
    counts: dict[str, int | None],
    **options: Any,
) -> None:
    """Train, and say where the result lies and what was measured."""
    check_positive(**counts)
    checkpoint = train(preset, output, **counts, **options)
    print(f"{output}: checkpoint {checkpoint.name}, preset {checkpoint.preset}, sha256 {checkpoint.sha256}")
    for group, values in checkpoint.metrics.items():
        for name, value in values.items():
            print(f"{group} {name} {value:.3g}")
