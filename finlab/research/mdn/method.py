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
from typing import ClassVar, NamedTuple

import numpy as np

from finlab.allocation.dual.method import Dual
from finlab.allocation.method import MAX_CANDIDATES, Method, Settings, Takes, number
from finlab.allocation.policy import Policy
from finlab.allocation.question import MethodQuestion
from finlab.allocation.rates import Rates
from finlab.allocation.solution import Candidates, Solution
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.physics.objective import Name, costs
from finlab.research.mdn.answers import (
    OTHER_START,
    PRESENT_MOTION,
    RefinedAnswers,
    Steps,
    effort_robot,
    follow,
    ranked,
    refined,
    traced,
)
from finlab.research.mdn.descent import realize
from finlab.research.mdn.features import Proposal, RobotFeatures, features_of, propose
from finlab.research.mdn.network import ForceMixture, ForceNetworkConfig
from finlab.research.networks.layers import single_threaded_products
from finlab.research.networks.learned_method import LearnedMethod
from finlab.research.networks.trained import TrainedWeights

TYPICAL_SHARE = 0.1
"""What a robot is mostly asked for, as a share of its wrench scale; wrenches are divided by
that."""
CHUNK = 64
"""Targets that are solved together; keeps memory flat for any number of targets."""
STEPS = Steps()
"""Of every answer."""
MORE_STEPS = Steps(commands=8)
"""Of answers that are not exact after those."""
TRACE_STEPS = Steps(descent=32, commands=3)
"""Of all proposals, when their refinement is shown: until each has come to its end."""
SWITCH_GAIN = 0.01
"""Share of its effort that a robot in motion must save before it moves otherwise."""
DISTANT_SWITCH_GAIN = 0.03
"""The same in the end, before its fins go towards commands that take several ticks."""
ORIGIN_NAMES = {OTHER_START: "another start", PRESENT_MOTION: "the way it moves now"}
"""What answers are called that no component has proposed."""


class RefinedProposals(NamedTuple):
    """Proposals of the network for some targets, and what came of them."""

    proposal: Proposal
    answers: RefinedAnswers


def names_of(proposal: Proposal) -> tuple[str, ...]:
    """What the proposals for a single target are called: the components they come from, from 1."""
    names = [f"component {k + 1}" for k in proposal.component[0]]
    return tuple(names)


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
        self, layout: Layout, settings: Settings, scale: Array, networks: TrainedWeights
    ) -> None:
        self.config = networks.network_of(ForceNetworkConfig)
        super().__init__(layout, settings, scale, networks)
        self.asked_scale = TYPICAL_SHARE * scale
        self.robot = effort_robot(self.plant, self.asked_scale)
        self._network = networks.single_precision
        self._one_thread = single_threaded_products()

    def solve(self, question: MethodQuestion) -> Solution:
        target = question.targets / self.asked_scale
        policy = question.policy
        previous = question.previous
        seed = question.seed
        if len(target) == 1:
            with self._one_thread():
                refined_proposals = self._proposed_and_refined(policy, target, seed)
                if previous is not None:
                    refined_proposals = self._in_motion(target, refined_proposals, previous)
            return Solution(
                self.robot.commands.feasible(refined_proposals.answers.command[:, 0]),
                candidates=lambda: self._candidates(target, *self._refined(refined_proposals)),
                samples=lambda: self._candidates(
                    target, *self._cheapest(refined_proposals.proposal)
                ),
            )
        command = np.empty((len(target), self.layout.n, 3))
        with self._one_thread():
            for k in range(0, len(target), CHUNK):
                chunk = slice(k, k + CHUNK)
                refined_proposals = self._proposed_and_refined(policy, target[chunk], seed + k)
                command[chunk] = refined_proposals.answers.command[:, 0]
        return Solution(command)

    def refinement(self, target: Array, *, flow: Array | None, seed: int) -> tuple[Candidates, ...]:
        normalized = target[None] / self.asked_scale
        with self._one_thread():
            proposal = self.proposals(normalized, seed)
            trace = traced(
                self.robot, normalized[0], proposal.force[0].astype(complex), TRACE_STEPS
            )
        names = names_of(proposal)
        every = self._candidates(normalized, np.concatenate(trace), names * len(trace))
        return every.split(len(trace))

    def proposals(self, target: Array, seed: int, count: int | None = None) -> Proposal:
        """Returns the network's proposals.

        Args:
            target: normalized targets (N, 6).
            seed: of what is drawn.
            count: of proposals; by default as many as the settings say.
        """
        count = count or self.settings.n_candidates
        features = features_of(self.robot.view, target)
        mixture = self.mixture(features)
        temperature = self.settings.temperature
        return propose(mixture, self.robot.view, features, count, temperature, seed)

    def mixture(self, features: RobotFeatures) -> ForceMixture:
        """What the network gives for the features of some targets."""
        return self.config(self._network, features.nodes, features.pairs)

    def _proposed_and_refined(self, policy: Policy, target: Array, seed: int) -> RefinedProposals:
        """Proposals for normalized targets (N, 6), and the answers that are refined from them."""
        proposal = self.proposals(target, seed)
        answers = follow(self.robot, target, proposal.force, self.settings.n_refined, STEPS)
        inexact = answers.error[:, 0] > self.robot.exact
        if inexact.any():
            first = RefinedAnswers._make(values[inexact] for values in answers)
            refined_further = self._refined_further(policy, target[inexact], first)
            for values, new in zip(answers, refined_further, strict=True):
                values[inexact] = new
        return RefinedProposals(proposal, answers)

    def _refined_further(
        self, policy: Policy, target: Array, answers: RefinedAnswers
    ) -> RefinedAnswers:
        """Answers that are exact, or that of the default method.

        More steps first; where these do not do, the default method knows what is to be delivered
        out of reach.

        Args:
            policy: what is delivered then.
            target: normalized targets (M, 6).
            answers: to them, inexact.
        """
        robot = self.robot
        answers = refined(robot, target, answers.command, answers.origin, MORE_STEPS)
        inexact = answers.error[:, 0] > robot.exact
        if inexact.any():
            unanswered = MethodQuestion(target[inexact] * self.asked_scale, policy)
            command = self._default.solve(unanswered).command
            wrench = robot.commands.wrench(command)
            answers.command[inexact, 0] = command
            answers.wrench[inexact, 0] = wrench
            answers.error[inexact, 0] = np.linalg.norm(wrench - target[inexact], axis=1)
            answers.effort[inexact, 0] = robot.effort(command)
            answers.origin[inexact, 0] = OTHER_START
        return answers

    @cached_property
    def _default(self) -> Method:
        """The default method, for targets out of reach."""
        return Dual(self.layout, Dual.settings_class(), self.scale)

    def _in_motion(
        self, target: Array, free: RefinedProposals, previous: Array
    ) -> RefinedProposals:
        """Answers for one target within what the servos allow in a tick.

        The robot goes on as it moves at present, and where other commands are worth it, all fins go
        towards these.

        Args:
            target: one normalized target (1, 6).
            free: proposals and answers without limits of a tick.
            previous: the command of the tick before (n, 3).
        """
        first = free.answers
        plant = self.plant
        rates = Rates(plant, self.layout.rates * self.settings.period_s)
        if rates.allow(previous, first.command[0, 0]):
            return free
        in_tick = self.robot.within(rates.box(previous))
        present = plant.feasible(np.where(np.isfinite(previous), previous, plant.lower))
        present_force = plant.force(present)
        planar_force = present_force[:, 1] + 1j * present_force[:, 2]
        force = np.insert(free.proposal.force, 0, planar_force, axis=1)
        refined_answers = follow(in_tick, target, force, self.settings.n_refined, STEPS, kept=1)
        refined_answers = refined_answers._replace(
            origin=np.where(refined_answers.origin == 0, PRESENT_MOTION, refined_answers.origin - 1)
        )
        present_first = np.argsort(refined_answers.origin[0] != PRESENT_MOTION, kind="stable")
        refined_answers = ranked(
            in_tick,
            RefinedAnswers._make(values[:, present_first] for values in refined_answers),
            SWITCH_GAIN,
        )
        if refined_answers.error[0, 0] > in_tick.exact:
            refined_answers = refined(
                in_tick, target, refined_answers.command, refined_answers.origin, MORE_STEPS
            )
        if first.effort[0, 0] < (1.0 - DISTANT_SWITCH_GAIN) * refined_answers.effort[0, 0]:
            towards = in_tick.commands.feasible(first.command[:, :1])
            other = refined(in_tick, target, towards, first.origin[:, :1], MORE_STEPS)
            if other.error[0, 0] <= max(in_tick.exact, refined_answers.error[0, 0]):
                refined_answers = other.before(refined_answers)
        return free._replace(answers=refined_answers)

    def _refined(self, proposals: RefinedProposals) -> tuple[Array, tuple[str, ...]]:
        """The refined commands (P, n, 3) for a single target, and the components they come from."""
        names = names_of(proposals.proposal)
        origin = proposals.answers.origin[0].tolist()
        return proposals.answers.command[0], tuple(
            names[k] if k >= 0 else ORIGIN_NAMES[k] for k in origin
        )

    def _cheapest(self, proposal: Proposal) -> tuple[Array, tuple[str, ...]]:
        """The cheapest commands (K, n, 3) with the forces proposed for a single target, and their
        names."""
        forces = self.robot.forces
        command, _ = realize(forces, forces.fins.project(proposal.force[0].astype(complex)))
        return command, names_of(proposal)

    def _candidates(self, target: Array, command: Array, names: tuple[str, ...]) -> Candidates:
        """Commands (K, n, 3) for a normalized target (1, 6), by the fins' own laws."""
        command = self.robot.commands.feasible(command)
        wrench = self.robot.commands.wrench(command)
        error = TYPICAL_SHARE * np.linalg.norm(wrench - target, axis=-1)
        return Candidates(
            command, wrench * self.asked_scale, error, *costs(self.layout, command), names
        )
