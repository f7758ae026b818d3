"""`finlab train mdn|surrogate|allocator`: train the network of method `mdn`, or the paper's two networks.

On several graphics cards or machines `torchrun` starts the paper's: `torchrun --nproc-per-node 2 -m finlab
train allocator ...`.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg
from tyro.extras import SubcommandApp

from finlab.cli.inputs import check_positive

if TYPE_CHECKING:
    from finlab.networks.trained import TrainedWeights

verbs = SubcommandApp()

_Preset = Annotated[str, arg(metavar="NAME")]
_Output = Annotated[Path, arg(metavar="FOLDER", aliases=["-o"])]
_Seed = Annotated[int, arg(metavar="N")]
_Count = Annotated[int | None, arg(metavar="N")]
_Data = Annotated[Path | None, arg(metavar="FOLDER")]
_Device = Annotated[str | None, arg(metavar="NAME")]


@verbs.command
def mdn(
    output: _Output,
    preset: _Preset = "default",
    seed: _Seed = 0,
    minutes: _Count = None,
    steps: _Count = None,
    resume: bool = False,
) -> None:
    """Train the network of method `mdn` on what many starts find, and write a checkpoint folder.

    The answers are written first, on all cores; a later run into the same folder finds them.

    Args:
        output: folder for checkpoint, answers, log, curves and state.
        preset: recipe: default or smoke.
        seed: seed of the answers and of the first weights.
        minutes: time after which the run ends, answers included, instead of the recipe's.
        steps: most optimizer steps instead of the recipe's.
        resume: go on from the last state in the folder.
    """
    from finlab.mdn.training.train import train_mdn

    check_positive(minutes=minutes, steps=steps)
    seconds = None if minutes is None else 60.0 * minutes
    _report(output, train_mdn(preset, output, seed=seed, steps=steps, seconds=seconds, resume=resume))


@verbs.command
def surrogate(
    output: _Output,
    data: _Data = None,
    preset: _Preset = "paper",
    seed: _Seed = 0,
    steps: _Count = None,
    resume: bool = False,
    device: _Device = None,
) -> None:
    """Train the paper's physics surrogate and write a checkpoint folder with it alone.

    Args:
        output: folder for checkpoint, model card, log, curves and state.
        data: data set; the recipe's, made in the folder, by default.
        preset: recipe: smoke, short (with the allocator 20 minutes on two cores) or paper.
        seed: of the first weights and of the order of the data.
        steps: optimizer steps instead of the recipe's.
        resume: go on from the last state in the folder.
        device: such as cpu or cuda:1; a graphics card where there is one by default.
    """
    from finlab.paper.training.surrogate import train_surrogate

    check_positive(steps=steps)
    made = train_surrogate(preset, output, data=data, seed=seed, steps=steps, resume=resume, device=device)
    _report(output, made)


@verbs.command
def allocator(
    output: _Output,
    surrogate: Annotated[Path, arg(metavar="NAME|FOLDER")],
    data: _Data = None,
    preset: _Preset = "paper",
    seed: _Seed = 0,
    steps: _Count = None,
    resume: bool = False,
    device: _Device = None,
) -> None:
    """Train the paper's network with a frozen surrogate and write a whole checkpoint folder.

    Args:
        output: folder for checkpoint, model card, log, curves and state.
        surrogate: checkpoint whose surrogate guides the training.
        data: data set; that in the surrogate's folder, or else the recipe's, by default.
        preset: recipe: smoke, short (with the surrogate 20 minutes on two cores) or paper.
        seed: of the first weights, the noise and the order of the data.
        steps: optimizer steps instead of the recipe's.
        resume: go on from the last state in the folder.
        device: such as cpu or cuda:1; a graphics card where there is one by default.
    """
    from finlab.paper.training.allocator import train_allocator

    check_positive(steps=steps)
    made = train_allocator(
        preset,
        output,
        surrogate=surrogate,
        data=data,
        seed=seed,
        steps=steps,
        resume=resume,
        device=device,
    )
    _report(output, made)


def _report(output: Path, made: TrainedWeights) -> None:
    """Say where the result lies and what was measured."""
    print(f"{output}: checkpoint {made.name}, preset {made.preset}, sha256 {made.sha256}")
    for group, values in made.metrics.items():
        for name, value in values.items():
            print(f"{group} {name} {value:.3g}")
