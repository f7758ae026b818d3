"""`finlab data generate|interaction`, `finlab train mdn|surrogate|allocator|interaction|policy`:
data, networks."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import OmitArgPrefixes, Positional, arg

from finlab.cli.shared_options import Cluster, Count, check_positive

if TYPE_CHECKING:
    from finlab.research.networks.trained import TrainedWeights

_Preset = Annotated[str, arg(metavar="NAME")]
_Output = Annotated[Path, arg(metavar="FOLDER", aliases=["-o"])]
_Count = Annotated[int | None, arg(metavar="N")]


@dataclass(frozen=True)
class PaperOptions:
    """Options of both of the paper's trainings."""

    output: _Output
    """folder for checkpoint, model card, log, curves and state."""
    data: Annotated[Path | None, arg(metavar="FOLDER")] = None
    """data set of `finlab data generate`; that of the surrogate or of the recipe by default."""
    preset: _Preset = "paper"
    """recipe: smoke (a minute), shipped (what comes with finlab, one to two hours), short
    (20 minutes for both on two cores) or paper (a week)."""
    seed: Count = 0
    """of the first weights, the noise and the order of the data."""
    steps: _Count = None
    """optimizer steps instead of the recipe's."""
    resume: bool = False
    """go on from the last state in the folder."""
    device: Annotated[str | None, arg(metavar="NAME")] = None
    """such as cpu or cuda:1; a graphics card where there is one by default."""


def mdn(
    output: _Output,
    preset: _Preset = "default",
    seed: Count = 0,
    minutes: _Count = None,
    steps: _Count = None,
    resume: bool = False,
) -> None:
    """Train the network of method `mdn` on what many starts find, and write a checkpoint folder.

    The answers are written first, on all cores; a later run into the same folder finds them.

    Args:
        output: folder for checkpoint, answers, log, curves and state.
        preset: recipe: default, shipped (no clock) or smoke.
        seed: seed of the answers and of the first weights.
        minutes: time after which the run ends, answers included, instead of the recipe's.
        steps: most optimizer steps instead of the recipe's.
        resume: go on from the last state in the folder.
    """
    from finlab.research.mdn.training.train_mdn import train_mdn

    check_positive(minutes=minutes, steps=steps)
    seconds = None if minutes is None else 60.0 * minutes
    _report(
        output, train_mdn(preset, output, seed=seed, steps=steps, seconds=seconds, resume=resume)
    )


def surrogate(options: OmitArgPrefixes[PaperOptions]) -> None:
    """Train the paper's physics surrogate and write a checkpoint folder with it alone.

    With several graphics cards or machines: torchrun --nproc-per-node 2 -m finlab train surrogate
    ...
    """
    from finlab.research.paper.training.train import TrainingOptions, train_surrogate

    check_positive(steps=options.steps)
    _report(options.output, train_surrogate(TrainingOptions(**vars(options))))


def allocator(
    options: OmitArgPrefixes[PaperOptions], surrogate: Annotated[Path, arg(metavar="NAME|FOLDER")]
) -> None:
    """Train the paper's network with a frozen surrogate and write a whole checkpoint folder.

    With several graphics cards or machines: torchrun --nproc-per-node 2 -m finlab train allocator
    ...

    Args:
        surrogate: checkpoint whose surrogate guides the training.
    """
    from finlab.research.paper.training.train import TrainingOptions, train_allocator

    check_positive(steps=options.steps)
    _report(options.output, train_allocator(TrainingOptions(**vars(options)), surrogate))


def interaction(
    data: Annotated[Positional[Path | None], arg(metavar="DATA")] = None,
    *,
    output: _Output,
    seed: Count = 0,
    robots: Count = 1500,
    network: bool = False,
    steps: Count = 1800,
    minutes: _Count = None,
    resume: bool = False,
) -> None:
    """Learn what actuators do to each other from forward data of many robots, for robots never
    seen.

    What is learned are the weights of a model that is linear in them, and how they differ from
    robot to robot, in closed form and in about a minute. A layout names them: interaction: {type:
    linear, path: FILE}. With --network it is a network in place of that: {type: learned, path:
    FILE}.

    Args:
        data: NPZ file of `finlab data interaction`, or a folder with a layout file and a CSV file
            of the same name for each robot (docs/tutorials/tank.md); without it, random robots with
            random plants of several families, 20 samples each, of which the shipped weights are
            learned.
        output: folder for the weights; of a network also log, curves and state.
        seed: which robots are held out, of drawn robots, and of a network's first weights.
        robots: number of random robots, where there is no DATA.
        network: learn a network; needs torch.
        steps: of a network, optimizer steps.
        minutes: of a network, time after which the run ends.
        resume: of a network, go on from the last state in the folder.
    """
    from finlab.fit.interaction.samples import read_samples
    from finlab.research.interaction.random_samples import samples_of_families

    check_positive(steps=steps, minutes=minutes, robots=robots)
    samples = samples_of_families(robots, 20, seed) if data is None else read_samples(data)
    if network:
        from finlab.research.interaction.train import WEIGHTS_FILE, recipe, train

        file = output / WEIGHTS_FILE
        error = train(samples, output, recipe(steps, minutes=minutes), seed, resume)
    else:
        from finlab.interaction.linear import write_weights
        from finlab.research.interaction.linear_prior import LINEAR_FILE, train_weights

        file = output / LINEAR_FILE
        weights, error = train_weights(samples, seed)
        output.mkdir(parents=True, exist_ok=True)
        write_weights(file, weights)
    print(f"{file}: error {error:.3g} of the wrench scale on robots held out, noise included")


def policy(
    output: _Output,
    network: Literal["both", "head", "forces"] = "both",
    preset: _Preset = "default",
    seed: Count = 0,
    steps: _Count = None,
    resume: bool = False,
) -> None:
    """Distil method `dual` into policies for all robots, and write their networks.

    They propose where an answer begins, for robots of thrusters, pods and fins that were never
    seen: `finlab eval distilled --folder FOLDER` judges them (docs/theory/distilled.md).

    Args:
        output: folder for the networks, and of each log, curves and state.
        network: head, which a network makes for a robot and which gives multipliers, forces, which
            a Transformer gives for each wrench, or both.
        preset: recipe: default (half a minute of a core each), long (five minutes) or smoke
            (seconds).
        seed: of robots, wrenches and first weights.
        steps: optimizer steps instead of the recipe's.
        resume: go on from the last state in the folder.
    """
    from finlab.research.distilled.train import train_policy
    from finlab.research.distilled.trained_policy import CONFIGS

    check_positive(steps=steps)
    for name in CONFIGS:
        if network not in ("both", name):
            continue
        losses = train_policy(output, name, preset, seed, steps, resume)
        words = ", ".join(f"{key.replace('_', ' ')} {value:.4g}" for key, value in losses.items())
        print(f"{output}: network {name}, preset {preset}, {words}")


def _report(output: Path, made: TrainedWeights) -> None:
    if os.environ.get("RANK", "0") != "0":  # of several processes the first one speaks
        return
    print(f"{output}: checkpoint {made.name}, preset {made.preset}, sha256 {made.sha256}")
    for group, values in made.metrics.items():
        for name, value in values.items():
            print(f"{group} {name.replace('_', ' ')} {value:.4g}")


def generate(
    output: _Output,
    layouts: Count = 1000,
    commands: Count = 5000,
    seed: Count = 0,
    varied_limits: Annotated[float, arg(metavar="SHARE")] = 0.5,
    fin_model: Annotated[str, arg(metavar="NAME|FILE.csv")] = "drag",
    cluster: Cluster = None,
) -> None:
    """Draw random layouts and commands, and write them with the wrenches that they cause.

    A run that was stopped goes on when it is called again with the same arguments.

    Args:
        output: folder for the data set.
        layouts: random layouts of 2 to 5 fins.
        commands: random commands on each of them.
        seed: of all draws.
        varied_limits: share of the layouts whose fins have limits of their own.
        fin_model: what causes the wrenches: a law of fins by its name in layout files, such as
            drag, or a table of measured forces.
    """
    from finlab.errors import CommandError
    from finlab.layout import FinModelSpec
    from finlab.research.executor import on_cluster
    from finlab.research.paper.training.samples import DataSettings, generate

    check_positive(layouts=layouts, commands=commands)
    if seed < 0:
        raise CommandError(f"seed: expected a whole number from 0, got {seed}")
    if not 0.0 <= varied_limits <= 1.0:
        raise CommandError(f"varied-limits: expected a share from 0 to 1, got {varied_limits:g}")
    table = (("path", str(Path(fin_model).resolve())),)
    model = (
        FinModelSpec("table", table)
        if fin_model.lower().endswith(".csv")
        else FinModelSpec(fin_model)
    )
    with on_cluster(cluster):
        generate(output, DataSettings(layouts, commands, seed, varied_limits, model))
    print(f"{output}: {layouts} layouts with {commands} commands each, seed {seed}")


def interaction_data(
    output: Annotated[Path, arg(metavar="FILE.npz", aliases=["-o"])],
    layouts: Count = 4000,
    commands: Count = 20,
    seed: Count = 0,
    noise: Annotated[float, arg(metavar="SHARE")] = 0.02,
    actuators: tuple[Count, Count] = (4, 8),
    plant: Annotated[str | None, arg(metavar="FILE.py:NAME")] = None,
) -> None:
    """Draw robots whose jets meet, and write commands with the wrenches that a plant says they
    cause.

    Args:
        output: the NPZ file.
        layouts: random robots.
        commands: random commands on each of them.
        seed: of all draws.
        noise: standard deviation of the wrenches' noise, as a share of their size.
        actuators: least and most of a robot.
        plant: function of a layout and commands (K, n, 3) that gives wrenches (K, 6); the formula
            of jets when left out.
    """
    from finlab.fit.interaction.samples import write_samples
    from finlab.research.evaluation.method_specs import own_function
    from finlab.research.interaction.random_samples import random_samples, with_jets

    check_positive(layouts=layouts, commands=commands, actuators=actuators[0])
    oracle = with_jets if plant is None else own_function(plant)
    write_samples(output, random_samples(oracle, layouts, commands, seed, noise, actuators))
    print(f"{output}: {layouts} robots with {commands} commands each, seed {seed}")
