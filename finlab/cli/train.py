"""`finlab train surrogate|allocator|fast`: train the networks of a checkpoint.

All go on from the last saved state when they are called again with the same arguments, and the first two
run on several processes or machines under `torchrun ... -m finlab train ...`.
"""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg
from tyro.extras import SubcommandApp

from finlab.cli.inputs import check_positive

if TYPE_CHECKING:
    from finlab.inference.weights import TrainedWeights
    from finlab.layout import FinModelSpec

verbs = SubcommandApp()

_Preset = Annotated[str, arg(metavar="NAME")]
_Output = Annotated[Path, arg(metavar="FOLDER", aliases=["-o"])]
_Count = Annotated[int | None, arg(metavar="N")]


@verbs.command
def surrogate(
    output: _Output,
    preset: _Preset = "default",
    seed: Annotated[int, arg(metavar="N")] = 0,
    steps: _Count = None,
    stop_after: _Count = None,
    fin_model: Annotated[str, arg(metavar="NAME|FILE.csv")] = "drag",
) -> None:
    """Train the learned fin physics and write a checkpoint folder with it alone.

    Args:
        output: folder for checkpoint, log, loss curve and resume state.
        preset: recipe: default, paper or smoke.
        seed: seed of the data and of the first weights.
        steps: optimizer steps instead of the recipe's.
        stop_after: stop after so many steps; call again to go on.
        fin_model: what to learn: drag, lighthill, or a table of measured forces.
    """
    from finlab.training.surrogate import train_surrogate

    check_positive(steps=steps, stop_after=stop_after)
    spec = _fin_model(fin_model)
    checkpoint = train_surrogate(
        preset, output, seed=seed, steps=steps, stop_after=stop_after, fin_model=spec
    )
    _report(output, checkpoint)


@verbs.command
def allocator(
    output: _Output,
    surrogate: Annotated[Path, arg(metavar="NAME|FOLDER")],
    preset: _Preset = "default",
    seed: Annotated[int, arg(metavar="N")] = 0,
    steps: _Count = None,
    batch_size: _Count = None,
    learning_rate: Annotated[float | None, arg(metavar="X")] = None,
    stop_after: _Count = None,
) -> None:
    """Train the allocator network on a trained surrogate and write a whole checkpoint folder.

    Args:
        output: folder for checkpoint, log, loss curves and resume state.
        surrogate: checkpoint whose surrogate guides the training.
        preset: recipe: default, paper or smoke.
        seed: seed of the data and of the first weights.
        steps: optimizer steps instead of the recipe's.
        batch_size: samples per step, over all processes, instead of the recipe's.
        learning_rate: peak learning rate instead of the recipe's.
        stop_after: stop after so many steps; call again to go on.
    """
    from finlab.training.allocator import train_allocator

    check_positive(steps=steps, batch_size=batch_size, stop_after=stop_after)
    checkpoint = train_allocator(
        preset,
        output,
        surrogate=surrogate,
        seed=seed,
        steps=steps,
        batch_size=batch_size,
        learning_rate=learning_rate,
        stop_after=stop_after,
    )
    _report(output, checkpoint)


@verbs.command
def fast(
    output: _Output,
    checkpoint: Annotated[str, arg(metavar="NAME|FOLDER")] = "default",
    seed: Annotated[int, arg(metavar="N")] = 0,
    shards: Annotated[int, arg(metavar="N")] = 80,
    steps: Annotated[int, arg(metavar="N")] = 20_000,
    stop_after: _Count = None,
) -> None:
    """Train the fast path: a small network that learns the allocator's own best answers.

    Its weights go into the folder `fast` of the checkpoint that they were learned from.

    Args:
        output: folder for answers, weights, log and resume state.
        checkpoint: trained checkpoint whose answers are learned.
        seed: seed of the data and of the first weights.
        shards: files of 6400 answers to learn from.
        steps: optimizer steps.
        stop_after: stop after so many steps; call again to go on.
    """
    from finlab.allocation import load_allocator
    from finlab.training.distill.answers import AnswerSettings
    from finlab.training.distill.network import FastConfig
    from finlab.training.distill.train import FAST_TRAINING, train_fast

    check_positive(shards=shards, steps=steps, stop_after=stop_after)
    allocator = load_allocator(checkpoint=checkpoint)
    metrics = train_fast(
        allocator,
        output,
        config=FastConfig(),
        settings=replace(FAST_TRAINING, steps=steps),
        data=AnswerSettings(n_shards=shards, seed=seed),
        stop_after=stop_after,
    )
    for name, value in metrics.items():
        print(f"{name} {value:.3g}")


def _fin_model(name: str) -> "FinModelSpec":
    """A fin model by its name, or a table by its file."""
    from finlab.layout import FinModelSpec

    if name.lower().endswith(".csv"):
        return FinModelSpec("table", (("path", str(Path(name).resolve())),))
    return FinModelSpec(name)


def _report(output: Path, checkpoint: "TrainedWeights") -> None:
    """Say where the result lies and what was measured."""
    print(f"{output}: checkpoint {checkpoint.name}, preset {checkpoint.preset}, sha256 {checkpoint.sha256}")
    for group, values in checkpoint.metrics.items():
        for name, value in values.items():
            print(f"{group} {name} {value:.3g}")
