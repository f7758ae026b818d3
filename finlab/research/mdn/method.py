"""Method `mdn`: a mixture density network proposes ways to deliver a wrench, and each is made
exact.

The paper's idea with exact physics behind it. The network gives a joint mixture over the planar
forces of all fins; its components stand for different ways. Each proposal is followed downhill to
the least effort near it and made exact by the fins' own laws. What no component stands for is not
found: nothing else is tried. The answers are exact because of the refinement, and cheap because of
the network.

Where a target is out of reach the default method says which wrench is to be delivered in its place.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from finlab.allocation.dual.method import Dual
from finlab.allocation.method import Method, Takes
from finlab.allocation.policy import Policy
from finlab.allocation.rates import Rates
from finlab.allocation.settings import MAX_CANDIDATES, Settings, number
from finlab.allocation.solution import Candidates, Solution
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.physics.objective import Name, costs
from finlab.research.mdn.answers import (
    NOW,
    OTHER,
    Answers,
    Steps,
    effort_robot,
    follow,
    ranked,
    refined,
    traced,
)
from finlab.research.mdn.descent import realize
from finlab.research.mdn.features import Proposal, Seen, propose, see
from finlab.research.mdn.network import ForceMixture, ForceNetworkConfig
from finlab.research.networks.layers import single_threaded_products
from finlab.research.networks.learned_method import LearnedMethod
from finlab.research.networks.trained import TrainedWeights

USUAL_SHARE = 0.1
"""What a robot is mostly asked for, as a share of its yardstick; wrenches are divided by that."""
CHUNK = 64
"""Targets that are solved together; keeps memory flat for any number of targets."""
STEPS = Steps()
"""Of every answer."""
MORE = Steps(commands=8)
"""Of answers that were not exact yet."""
WHOLE = Steps(descent=32, commands=3)
"""Of all proposals, which are told apart by where they end."""
SWITCH_GAIN = 0.01
"""Share of its effort that a robot in motion must save before it changes the way it moves."""
WORTH_LEAVING = 0.03
"""The same in the end, before its fins go towards a way that takes several ticks."""
STARTS = {OTHER: "another start", NOW: "the way it moves now"}
"""What answers are called that no component has proposed."""


class Found(NamedTuple):
    """Proposals of the network for some targets, and what came of them."""

    proposal: Proposal
    answers: Answers


def names_of(proposal: Proposal) -> tuple[str, ...]:
    """What the proposals for a single target are called: the components they come from, from 1."""
    return tuple([f"component {k + 1}" for k in proposal.component[0]])


@dataclass(frozen=True)
class MdnSettings(Settings):
    """Settings of method `mdn`: how many ways the mixture proposes, and how many of them are
    refined."""

    objective: ClassVar[Name] = "effort"
    """What is kept least."""
    n_candidates: int = number(
        48, 1, MAX_CANDIDATES, "proposals K: the components' means by falling weight, then samples"
    )
    n_refined: int = number(6, 1, 256, "proposals that are refined and offered as candidates")
    temperature: float = number(
        1.0, 0.0, 100.0, "what the variances of the samples are multiplied by"
    )
    period_s: float = number(0.1, 0.0, 1000.0, "time between ticks", "s", above=True)


class Mdn(LearnedMethod):
    """Exact answers of little effort, refined from what a network proposes and from nothing
    else."""

    name = "mdn"
    takes: ClassVar[Takes] = "fins"
    policy_under_way = "direction"
    settings_class = MdnSettings
    settings: MdnSettings

    def __init__(
        self, layout: Layout, settings: Settings, scale: Array, weights: TrainedWeights
    ) -> None:
        self.config = weights.network_of(ForceNetworkConfig)
        super().__init__(layout, settings, scale, weights)
        self.sigma = USUAL_SHARE * scale
        self.robot = effort_robot(self.plant, self.sigma)
        self._network = weights.single_precision
        self._one_thread = single_threaded_products()

    def solve(self, targets: Array, *, policy: Policy, **wanted: Any) -> Solution:
        target = targets / self.sigma
        previous = wanted.get("previous")
        seed = wanted.get("seed", 0)
        if len(target) == 1:
            with self._one_thread():
                reached = self._found(policy, target, seed)
                if previous is not None:
                    reached = self._in_motion(target, reached, previous)
            return Solution(
                self.robot.commands.feasible(reached.answers.command[:, 0]),
                candidates=lambda: self._judged(target, *self._refined(reached)),
                samples=lambda: self._judged(target, *self._cheapest(reached.proposal)),
            )
        command = np.empty((len(target), self.layout.n, 3))
        with self._one_thread():
            for k in range(0, len(target), CHUNK):
                some = slice(k, k + CHUNK)
                command[some] = self._found(policy, target[some], seed + k).answers.command[:, 0]
        return Solution(command)

    def refinement(self, target: Array, *, flow: Array | None, seed: int) -> tuple[Candidates, ...]:
        wanted = target[None] / self.sigma
        with self._one_thread():
            proposal = self.proposals(wanted, seed)
            ways = traced(self.robot, wanted[0], proposal.force[0].astype(complex), WHOLE)
        names = names_of(proposal)
        count = len(ways[0])
        every = self._judged(wanted, np.concatenate(ways), names * len(ways))
        return tuple([every.rows(slice(k, k + count)) for k in range(0, len(every.command), count)])

    def proposals(self, target: Array, seed: int, count: int | None = None) -> Proposal:
        """The network's proposals for normalized targets (N, 6); by default as many as the settings
        say."""
        count = count or self.settings.n_candidates
        seen = see(self.robot.view, target)
        return propose(
            self.mixture(seen), self.robot.view, seen, count, self.settings.temperature, seed
        )

    def mixture(self, seen: Seen) -> ForceMixture:
        """What the network gives for what it sees of some targets."""
        return self.config(self._network, seen.nodes, seen.pairs)

    def _found(self, policy: Policy, target: Array, seed: int) -> Found:
        """What is found for normalized targets (N, 6)."""
        proposal = self.proposals(target, seed)
        answers = follow(self.robot, target, proposal.force, self.settings.n_refined, STEPS)
        missed = answers.error[:, 0] > self.robot.exact
        if missed.any():
            first = Answers._make(values[missed] for values in answers)
            for kept, new in zip(
                answers, self._at_last(policy, target[missed], first), strict=True
            ):
                kept[missed] = new
        return Found(proposal, answers)

    def _at_last(self, policy: Policy, target: Array, answers: Answers) -> Answers:
        """Answers to normalized targets (M, 6) that were missed at first: after more steps, or that
        of the default method, which tells what is to be delivered out of reach."""
        robot = self.robot
        answers = refined(robot, target, answers.command, answers.origin, MORE)
        missed = answers.error[:, 0] > robot.exact
        if missed.any():
            wanted = target[missed]
            command = self._default.solve(wanted * self.sigma, policy=policy).command
            wrench = robot.commands.wrench(command)
            error = np.linalg.norm(wrench - wanted, axis=1)
            replaced = (command, wrench, error, robot.effort(command), np.full(len(wanted), OTHER))
            for kept, new in zip(answers, replaced, strict=True):
                kept[missed, 0] = new
        return answers

    @cached_property
    def _default(self) -> Method:
        return Dual(self.layout, Dual.settings_class(), self.scale)

    def _in_motion(self, target: Array, free: Found, previous: Array) -> Found:
        """What is found for one target within what the servos allow after a previous command (n,
        3): the way that the robot moves now is kept, and where another is worth it, all fins go
        towards that."""
        first = free.answers
        plant = self.plant
        rates = Rates(plant, self.layout.rates * self.settings.period_s)
        if rates.allow(previous, first.command[0, 0]):
            return free
        near = self.robot.within(rates.box(previous))
        moves = plant.force(plant.feasible(np.where(np.isfinite(previous), previous, plant.lower)))
        force = np.insert(free.proposal.force, 0, moves[:, 1] + 1j * moves[:, 2], axis=1)
        reached = follow(near, target, force, self.settings.n_refined, STEPS, kept=1)
        reached = reached._replace(origin=np.where(reached.origin == 0, NOW, reached.origin - 1))
        now_first = np.argsort(reached.origin[0] != NOW, kind="stable")
        reached = ranked(
            near, Answers._make(values[:, now_first] for values in reached), SWITCH_GAIN
        )
        if reached.error[0, 0] > near.exact:
            reached = refined(near, target, reached.command, reached.origin, MORE)
        if first.effort[0, 0] < (1.0 - WORTH_LEAVING) * reached.effort[0, 0]:
            towards = near.commands.feasible(first.command[:, :1])
            other = refined(near, target, towards, first.origin[:, :1], MORE)
            if other.error[0, 0] <= max(near.exact, reached.error[0, 0]):
                reached = other.before(reached)
        return free._replace(answers=reached)

    def _refined(self, reached: Found) -> tuple[Array, tuple[str, ...]]:
        """The refined commands (P, n, 3) for a single target, and the components they come from."""
        names = names_of(reached.proposal)
        origin = reached.answers.origin[0].tolist()
        return reached.answers.command[0], tuple(names[k] if k >= 0 else STARTS[k] for k in origin)

    def _cheapest(self, proposal: Proposal) -> tuple[Array, tuple[str, ...]]:
        """The cheapest commands (K, n, 3) with the forces proposed for a single target, and their
        names."""
        forces = self.robot.forces
        command, _ = realize(forces, forces.fins.project(proposal.force[0].astype(complex)))
        return command, names_of(proposal)

    def _judged(self, target: Array, command: Array, names: tuple[str, ...]) -> Candidates:
        """Commands (K, n, 3) for a normalized target (1, 6), by the fins' own laws."""
        command = self.robot.commands.feasible(command)
        wrench = self.robot.commands.wrench(command)
        error = USUAL_SHARE * np.linalg.norm(wrench - target, axis=-1)
        return Candidates(command, wrench * self.sigma, error, *costs(self.layout, command), names)
