"""Robots whose jets hit each other and the hull: what answers miss by a plant that no method was
told."""

import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from copy import copy
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from finlab.allocation.dual.method import Dual, DualSettings
from finlab.allocation.question import MethodQuestion
from finlab.arrays import NEARLY, ROUNDS, Array
from finlab.fit.interaction.constants import fit_constants
from finlab.fit.interaction.own_samples import posterior, terms_of
from finlab.fit.interaction.samples import Samples, left_by_laws
from finlab.interaction.interaction import Interaction
from finlab.interaction.learned import Learned
from finlab.interaction.linear import SHIPPED_PRIOR, LinearInteraction, Weights, read_weights
from finlab.layout import Layout, load_layout
from finlab.layout.effectiveness import body_force
from finlab.layout.jet_geometry import jet_geometry_of
from finlab.physics import Plant
from finlab.physics.objective import wrench_scale_of
from finlab.research.evaluation.document import Column, Row
from finlab.research.evaluation.experiment import Experiment, check_names, progress
from finlab.research.evaluation.method_specs import own_function
from finlab.research.evaluation.scoring import mean_interval
from finlab.research.interaction.fourier_features import FourierFeatures
from finlab.research.interaction.judging_plant import wrenches
from finlab.research.interaction.linear_prior import train_weights
from finlab.research.interaction.random_samples import (
    JETS,
    WrenchOracle,
    random_flows,
    random_samples,
    spread_apart,
)
from finlab.research.random_layouts import ActuatorMaker, random_jet_robot, random_shaft_fin


class Group(NamedTuple):
    """Robots that no training has seen."""

    actuators: tuple[int, int] = (3, 8)
    """How many actuators, least to most."""
    kinds: Sequence[ActuatorMaker] | None = None
    """Kinds of these; None for thrusters, azimuths, fins and mixtures."""
    apart: float = 1.0
    """Distances of actuators and size of the hull, over those of robots that are learned from."""
    speed: float = 0.0
    """Of the robots through the water, in any direction [m/s]."""
    shipped: tuple[str, ...] = ()
    """Names of shipped robots in place of random ones."""


SHIPPED_ROBOTS = (
    "bluerov2",
    "bluerov2_heavy",
    "octo",
    "hexa",
    "turtle_hybrid",
    "catamaran",
    "penta",
)
"""Shipped robots with a hull and jets that may meet it."""
AT_REST = {
    "3 to 8 actuators": Group(),
    "6 to 8 fins": Group((6, 8), [random_shaft_fin]),
    "8 actuators": Group((8, 8)),
    "12 actuators": Group((12, 12)),
    "half as far apart": Group(apart=0.5),
    "twice as far apart": Group(apart=2.0),
    "shipped robots": Group(shipped=SHIPPED_ROBOTS),
}
"""Groups of robots at rest, which any plant can judge."""
GROUPS = AT_REST | {
    "3 to 8 actuators at 0.5 m/s": Group(speed=0.5),
    "3 to 8 actuators at 1 m/s": Group(speed=1.0),
    "shipped robots at 1 m/s": AT_REST["shipped robots"]._replace(speed=1.0),
}
"""All groups of robots."""
OWN_SAMPLES = (20, 100)
"""Own samples that the linear model is given."""
FITTED = 20
"""Own samples that the formula is fitted to."""


def run(
    plant: str | None = None,
    groups: tuple[str, ...] = tuple(AT_REST),
    robots: int = 20,
    targets: int = 6,
    layouts: int = 4000,
    steps: int = 1800,
    network: str | None = None,
    own: tuple[int, ...] = (30, 100, 300, 1000),
    seed: int = 0,
) -> Iterator[Row]:
    """One row for each group of robots and each model of what actuators do to each other.

    Args:
        plant: judge and teacher, as file.py:function or module:function of a layout and commands
            (K, n, 3) that gives wrenches (K, 6); when left out, a plant of another family than any
            model or prior, by which no choice was made.
        groups: of robots. Where these move, a plant has to take a flow (K, 6) as third argument;
            the linear model is then learned at speeds up to the group's, and there are no networks.
        robots: of each group; of shipped ones no more than there are.
        targets: on each robot, wrenches of random commands by the plant.
        layouts: that models of this plant learn from, 20 samples each with 2 % noise.
        steps: of the training of the network.
        network: file of `finlab train interaction` in place of one that is trained now;
            `none` for no networks, which need torch.
        own: samples of each robot that a ridge regression is given.
        seed: of all draws.
    """
    check_names("groups", groups, GROUPS)
    oracle = wrenches if plant is None else own_function(plant)
    with tempfile.TemporaryDirectory() as folder:
        models: dict[float, dict[str, Model]] = {}
        for name in groups:
            group = GROUPS[name]
            if group.speed not in models:
                models[group.speed] = _models(
                    oracle, layouts, steps, network, own, group.speed, seed, Path(folder)
                )
            cases = _cases(oracle, group, robots, targets, max(*own, *OWN_SAMPLES), seed)
            by_laws: Row = {}
            for title, model in models[group.speed].items():
                row = _row(oracle, model, cases, title)
                by_laws = by_laws or row
                for key in ("forward_rms", "error_mean"):
                    row[f"{key}_of_laws"] = row[key] / by_laws[key]
                yield {"robots": name, "model": title} | row


def _cases(
    oracle: WrenchOracle, group: Group, robots: int, targets: int, own: int, seed: int
) -> "list[Case]":
    """Robots of a group, each with targets and own samples."""
    cases = []
    for k in range(min(robots, len(group.shipped)) if group.shipped else robots):
        rng = np.random.default_rng([32_000, seed, k])
        if group.shipped:
            layout = load_layout(group.shipped[k])
        else:
            layout = random_jet_robot(rng, f"robot_{k + 1}", group.actuators, group.kinds)
        layout = spread_apart(layout, group.apart)
        tested = Plant(layout).sample(rng, (targets,))
        # A row of targets is one question in one flow: all have the same.
        flow = random_flows(rng, 1, 1.0)[0]
        flow *= group.speed / np.linalg.norm(flow)
        moving = _moving(oracle, flow)
        wrench = moving(layout, tested)
        command = Plant(layout).sample(rng, (own,))
        noise = 0.02 * np.sqrt((wrench**2).mean(axis=0))
        measured = moving(layout, command) + noise * rng.normal(size=(len(command), 6))
        flows = np.broadcast_to(flow, (len(command), 6)) if group.speed > 0.0 else None
        own_samples = Samples(layout, command, measured, flows)
        cases.append(Case(layout, flow, tested, wrench, own_samples))
    return cases


class Case(NamedTuple):
    """A robot, and what it is asked."""

    layout: Layout
    flow: Array
    """Its velocity through the water (6,) [m/s, rad/s]."""
    command: Array
    """Commands (K, n, 3) that give the wrenches."""
    wrench: Array
    """Targets (K, 6) [N, N m]."""
    own: Samples


def _moving(oracle: WrenchOracle, flow: Array) -> WrenchOracle:
    """The plant in a flow (6,) [m/s, rad/s], which it is not told of at rest."""
    if not flow.any():
        return oracle
    return lambda layout, command: oracle(layout, command, np.broadcast_to(flow, (len(command), 6)))


Model = Callable[[Samples], Interaction | None]
"""From own samples of a robot to what answers are told of it."""


def _models(
    oracle: WrenchOracle,
    layouts: int,
    steps: int,
    network: str | None,
    own: tuple[int, ...],
    speed: float,
    seed: int,
    folder: Path,
) -> dict[str, Model]:
    """All models by their names in the table; without `network` one is trained, in `folder`."""
    samples = random_samples(oracle, layouts, 20, seed, 0.02, (3, 8), speed)
    weights, _ = train_weights(samples, seed)

    def linear(prior: Weights, count: int) -> Model:
        """The linear model, after some own samples."""

        def of(own: Samples) -> Interaction:
            known = posterior(terms_of(_some(own, count)), prior) if count else prior
            return LinearInteraction(known, jet_geometry_of(own.layout))

        return of

    models: dict[str, Model] = {
        "laws alone": lambda _: None,
        "formula": lambda own: JETS.of(jet_geometry_of(own.layout)),
        f"formula, {FITTED} own samples": lambda own: fit_constants(_some(own, FITTED)).jets.of(
            jet_geometry_of(own.layout)
        ),
    }
    priors = {"shipped prior": read_weights(str(SHIPPED_PRIOR)), "prior of this plant": weights}
    for name, prior in priors.items():
        for count in (0, *OWN_SAMPLES):
            models[f"{name}, {count} own samples"] = linear(prior, count)
    if speed == 0.0:
        process = FourierFeatures(samples, seed)
        models["Gaussian process of this plant"] = lambda own: _ByDifferences(
            partial(process.wrench_offset, jet_geometry_of(own.layout))
        )
    if speed == 0.0 and network != "none":
        models |= _network_models(samples, steps, network, seed, folder)
    for count in own:
        models[f"ridge, {count} own samples"] = partial(Ridge, count)
    return models | {"oracle": linear(weights, 0)}


def _network_models(
    samples: list[Samples], steps: int, network: str | None, seed: int, folder: Path
) -> dict[str, Model]:
    """The models by networks, by their names in the table."""
    from finlab.research.interaction.surrogate_form import trained_surrogate
    from finlab.research.interaction.train import WEIGHTS_FILE, recipe, train

    if network is None:
        train(samples, folder, recipe(steps), seed)
    file = network or str(folder / WEIGHTS_FILE)
    node = trained_surrogate(samples, seed)
    return {
        "network of this plant": lambda own: Learned(file).of(jet_geometry_of(own.layout)),
        "the paper's surrogate form, of this plant": lambda own: _ByDifferences(node(own.layout)),
    }


def _some(samples: Samples, count: int) -> Samples:
    """The first `count` samples of a robot."""
    return samples.some(slice(count))


def _row(oracle: WrenchOracle, model: Model, cases: list[Case], name: str) -> Row:
    """Errors, by the oracle, of what `dual` answers with a model, over all robots."""
    misses = []
    counted = []
    deviations = []
    forwards = []
    watts = []
    milliseconds = []
    for case in progress(cases, "robot", name):
        layout = case.layout
        scale = wrench_scale_of(layout)
        moving = _moving(oracle, case.flow)
        told: Any = model(case.own)
        method = Dual(layout, DualSettings(), scale)
        plant = copy(method.plant)
        plant.interaction = told
        plant.feels_flow = plant.feels_flow or told is not None
        method.plant = plant.at(case.flow if case.flow.any() else None)
        counts = layout.commanded
        question = MethodQuestion(counts * case.wrench, free=None if counts.all() else ~counts)
        begun = time.thread_time()
        command = method.solve(question).command
        milliseconds.append(1e3 * (time.thread_time() - begun) / len(command))
        if name == "oracle":
            command = np.array(
                [_exact(moving, method, w, u) for w, u in zip(case.wrench, command, strict=True)]
            )
        misses.append(counts * (moving(layout, command) - case.wrench) / scale)
        counted.append(np.broadcast_to(counts, misses[-1].shape))
        force = body_force(method.plant.force(command), layout.frames)
        inflow = method.plant.met_by_all(None)
        deviation = np.zeros_like(misses[-1])
        if told is not None:
            deviation = told.deviation(force, inflow) / scale
        deviations.append(deviation)
        known = method.plant.wrench_of(method.plant.force(case.command))
        forwards.append(counts * (known - case.wrench) / scale)
        watts.append(method.plant.power(command).sum(axis=1))
    missed = np.concatenate(misses)
    robot = np.repeat(np.arange(len(cases)), [len(case.wrench) for case in cases])
    error = np.linalg.norm(missed, axis=1)
    forward = np.linalg.norm(np.concatenate(forwards), axis=1)
    deviation = np.concatenate(deviations)
    on_axes = np.concatenate(counted)
    is_uncertain = bool(deviation.any()) and name != "oracle"
    return {
        "n": len(error),
        "forward_rms": float(np.sqrt((forward**2).mean())),
        "error_mean": float(error.mean()),
        "error_mean_interval": list(mean_interval(error, robot)),
        "error_median": float(np.median(error)),
        "error_p95": float(np.percentile(error, 95)),
        "inside_50": _inside(missed[on_axes], deviation[on_axes], 0.674) if is_uncertain else None,
        "inside_90": _inside(missed[on_axes], deviation[on_axes], 1.645) if is_uncertain else None,
        "power_mean": float(np.concatenate(watts).mean()),
        "ms": float(np.median(milliseconds)),
    }


def _inside(missed: Array, deviation: Array, half_width: float) -> float:
    """Share of the errors (N,) that lie within so many of their standard deviations."""
    return float((np.abs(missed) <= half_width * deviation + NEARLY).mean())


def _exact(oracle: WrenchOracle, method: Dual, wrench: Array, command: Array) -> Array:
    """A command near to another one (n, 3) that gives a wrench (6,) by the plant: least Newton
    steps."""
    plant = method.plant
    width = np.maximum(method.plant.width, NEARLY)
    best = command
    least = np.inf
    for _ in range(ROUNDS):
        steps = 1e-4 * np.eye(command.size).reshape(-1, *command.shape) * width
        given = (
            oracle(method.layout, np.concatenate([command[None], command + steps])) / method.scale
        )
        counts = method.layout.commanded
        error = float(np.linalg.norm((given[0] - wrench / method.scale)[counts]))
        if error < least:
            best = command
            least = error
        if error <= NEARLY:
            break
        slope = ((given[1:] - given[0]) / 1e-4).T[counts]
        missing = (wrench / method.scale - given[0])[counts]
        change = np.linalg.lstsq(slope, missing, rcond=1e-6)[0]
        command = plant.feasible(
            command + np.clip(change, -0.2, 0.2).reshape(command.shape) * width
        )
    return best


class _ByDifferences(Interaction):
    """An interaction by a function of all forces, with derivatives by differences."""

    def __init__(self, function: Callable[[Array], Array]) -> None:
        """Takes a function from forces (K, n, 3) [N] to wrenches (K, 6) [N, N m]."""
        self._function = function

    def offset(self, force: Array, inflow: Array | None = None) -> Array:
        """The wrench (..., 6) [N, N m] at forces (..., n, 3) [N]; no flow changes it."""
        return self._function(force.reshape(-1, *force.shape[-2:])).reshape(*force.shape[:-2], 6)

    def effect(self, force: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        """The same, and its derivatives (..., n, 3, 6) by forward differences of 1e-4 N."""
        flat = force.reshape(-1, *force.shape[-2:])
        count = flat[0].size
        step = 1e-4
        moved = flat[:, None] + step * np.eye(count).reshape(count, *flat.shape[1:])
        here = self._function(flat)
        slope = (
            self._function(moved.reshape(-1, *flat.shape[1:])).reshape(len(flat), count, 6)
            - here[:, None]
        ) / step
        return here.reshape(*force.shape[:-2], 6), slope.reshape(*force.shape, 6)

    def deviation(self, force: Array, inflow: Array | None = None) -> Array:
        """No deviation (..., 6): the function is taken to be exact."""
        return np.zeros((*force.shape[:-2], 6))


class Ridge(_ByDifferences):
    """What the laws leave of own samples, by ridge regression on forces, their sizes and products
    of these, with the penalty that leaves least of samples left out one by one."""

    def __init__(self, count: int, samples: Samples) -> None:
        """Takes how many of the samples count, and the samples."""
        force, left, scale, _ = left_by_laws(_some(samples, count))
        unit = float(np.abs(force).max())

        def features(force: Array) -> Array:
            """Forces (K, n, 3) as rows: 1, parts, sizes, and products of parts with sizes."""
            scaled = force / unit
            size = np.linalg.norm(scaled, axis=-1)
            flat = scaled.reshape(len(force), -1)
            pairs = flat[:, :, None] * size[:, None, :]
            return np.concatenate(
                [np.ones((len(force), 1)), flat, size, pairs.reshape(len(force), -1)], axis=1
            )

        known = features(force)
        left_u, values, right = np.linalg.svd(known, full_matrices=False)
        best = np.inf
        weights = np.zeros((known.shape[1], 6))
        for penalty in np.geomspace(1e-4, 10.0, 12) * values[0]:
            kept = values**2 / (values**2 + penalty**2)
            leverage = np.minimum(((left_u**2) * kept).sum(axis=1), 0.999)
            alone = (left - (left_u * kept) @ (left_u.T @ left)) / (1.0 - leverage)[:, None]
            if (alone**2).sum() < best:
                best = float((alone**2).sum())
                weights = right.T @ (
                    (values / (values**2 + penalty**2))[:, None] * (left_u.T @ left)
                )
        super().__init__(lambda force: features(force) @ weights * scale)


experiment = Experiment(
    name="interaction",
    question="Where jets hit each other and the hull: what do answers miss that know the laws "
    "alone, a formula, a network, or the robot's own samples?",
    columns=(
        Column("robots", "robots", "text"),
        Column("model", "told", "text"),
        Column("n", "targets", "count"),
        Column("forward_rms", "forward", "error"),
        Column("forward_rms_of_laws", "over laws", "three"),
        Column("error_mean", "error, mean", "error", "error_mean_interval"),
        Column("error_mean_of_laws", "over laws", "three"),
        Column("error_median", "median", "error"),
        Column("error_p95", "95 %", "error"),
        Column("inside_50", "within 50 %", "three"),
        Column("inside_90", "within 90 %", "three"),
        Column("power_mean", "power [W]", "three"),
        Column("ms", "ms", "three"),
    ),
    run=run,
    note=(
        "The plant that judges is of another family than the formula and than those that the "
        "shipped prior was learned from (`finlab/research/interaction/judging_plant.py`); models "
        "of this plant learned it from other robots. Forward: root mean square of what the model "
        "misses of the plant's wrenches at random commands, at which the targets are. Error: what "
        "the plant's wrench misses of the target, over the robot's wrench scale, of the axes that "
        "it commands. Over laws: divided by that of the laws alone. Targets are wrenches of "
        "random commands by the plant. The oracle goes on from the linear model's answer by the "
        "plant itself. Within 50 and 90 %: share of the misses, axis by axis, that lie in the "
        "intervals of `expected_miss`. ms: processor time of one of a robot's answers."
    ),
    measures=(
        "finlab/interaction",
        "finlab/research/interaction",
        "finlab/research/evaluation/experiments/interaction.py",
    ),
    quick={
        "groups": ("3 to 8 actuators", "3 to 8 actuators at 1 m/s"),
        "robots": 3,
        "targets": 2,
        "layouts": 60,
        "steps": 100,
        "own": (100,),
    },
    usual={
        "groups": tuple(GROUPS),
        "robots": 7,
        "targets": 3,
        "layouts": 500,
        "steps": 600,
        "own": (100,),
    },
)
