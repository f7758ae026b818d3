"""The paper's own pipeline: sample the mixture, rank by the surrogate, refine with Adam. numpy
only."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from finlab.allocation.levenberg_marquardt import CommandProblem
from finlab.allocation.method import (
    MAX_CANDIDATES,
    LeastErrorMethod,
    Settings,
    Takes,
    choice,
    number,
    switch,
)
from finlab.allocation.solution import Candidates, Solution
from finlab.arrays import AnyArray, Array
from finlab.layout import FinModelSpec, Layout
from finlab.physics.objective import EffortMeter, costs
from finlab.research.networks.layers import single_threaded_products
from finlab.research.networks.learned_method import LearnedMethod
from finlab.research.networks.trained import TrainedWeights, to_command, to_normalized
from finlab.research.paper.network import Mixture, NetworkConfig, raw_features
from finlab.research.paper.surrogate import LayoutSurrogate, blocks_of

STEPS = 160
"""Steps of Adam."""


@dataclass(frozen=True)
class PaperSettings(Settings):
    """The stages of the paper's pipeline.

    What the paper does not print is a choice made here: gamma and the weights of J_en, Adam's rate,
    the number of refined candidates and steps, that the best step is kept, and that zero directions
    turn on beyond the seam.
    """

    n_candidates: int = number(64, 1, MAX_CANDIDATES, "candidates K drawn from the mixture")
    temperature: float = number(0.02, 0.0, 100.0, "T of the sampling; 0.02 in the paper")
    gamma: float = number(1e-4, 0.0, 1e6, "weight of the effort in J = J_norm + gamma J_en")
    n_refined: int = number(4, 1, 256, "best-ranked candidates that are refined")
    refinement: str = choice(
        "adam", ("none", "adam"), "how candidates are refined; none is an ablation"
    )
    n_steps: int = number(STEPS, 0, 10_000, "steps of the refinement")
    warm_start: str = choice(
        "mdn", ("mdn", "random"), "where candidates come from; random is an ablation"
    )
    ranking: str = choice(
        "physics", ("physics", "nll"), "by J, or by likelihood, which is an ablation"
    )
    mean_only: bool = switch(
        False, "take the mixture's mean and nothing else, which is an ablation"
    )


CHUNK = 250
"""Targets that are solved together; keeps memory flat for any number of targets."""
ADAM_RATE = 0.03
"""Adam's first step, in units of half a limit range; it falls to a twentieth of that."""
ADAM_DECAY = (0.9, 0.999)
"""Decays of Adam's running means of the gradient and of its square (Kingma and Ba, 2015)."""


class Paper(LearnedMethod, LeastErrorMethod):
    """Mixture density network, physics-guided ranking and gradient refinement, by the printed
    equations."""

    name = "paper"
    takes: ClassVar[Takes] = "horizontal fins"
    settings_class = PaperSettings
    settings: PaperSettings
    shipped_checkpoint = "paper"

    def __init__(
        self, layout: Layout, settings: Settings, scale: Array, networks: TrainedWeights
    ) -> None:
        super().__init__(layout, settings, scale, networks)
        self.config = networks.network_of(NetworkConfig)
        self.surrogate = LayoutSurrogate(layout, networks)
        self.normalization = networks.normalization
        self.fin_model = FinModelSpec.from_values(networks.fin_model)
        self._network = networks.single_precision
        self._one_thread = single_threaded_products()
        effectiveness = self.surrogate.effectiveness / networks.normalization.std
        self._effectiveness = effectiveness.reshape(-1, 6)
        """Normalized wrench (3n, 6) per newton of each fin's force along the axes of the body."""
        self.limits = layout.lower.astype(np.float32), layout.upper.astype(np.float32)
        """Lower and upper limits (n, 3), in single precision as all else here."""
        features = raw_features(layout.position, layout.mounting_angle, layout.lower, layout.upper)
        self._features = features.astype(np.float32)
        self._effort = EffortMeter(layout.upper)
        self._commands = CommandProblem.of(self.plant, networks.normalization.std)
        """Brings directions to the nearer end of an arc, as angles."""

    def _solve(self, targets: AnyArray, *, seed: int, previous: AnyArray | None) -> Solution:
        if len(targets) == 1:
            with self._one_thread():
                return self._solve_chunk(targets, seed)
        starts = range(0, len(targets), CHUNK)
        parts = [self._solve_chunk(targets[k : k + CHUNK], seed + k) for k in starts]
        wrench = [part.wrench for part in parts if part.wrench is not None]
        return Solution(
            np.concatenate([part.command for part in parts]), wrench=np.concatenate(wrench)
        )

    def _solve_chunk(self, targets: AnyArray, seed: int) -> Solution:
        settings = self.settings
        sampled, normalized = self._sampled(targets, seed)
        chosen = sampled[:, : settings.n_refined]
        if not settings.mean_only:
            chosen = self._refine(chosen, normalized)
        # Without physics in the ranking the likeliest candidate stays the answer.
        if not self._by_likelihood:
            order = np.argsort(self._score(chosen, normalized), axis=1, kind="stable")
            chosen = _take(chosen, order)
        return Solution(
            self._inside(chosen[:, 0]),
            wrench=self.surrogate.wrench(chosen[:, 0]).astype(np.float64),
            candidates=lambda: self._candidates(chosen[0], targets[0], "refined"),
            samples=lambda: self._candidates(sampled[0], targets[0], "sample"),
        )

    @property
    def _by_likelihood(self) -> bool:
        return self.settings.ranking == "nll" and not self.settings.mean_only

    def _sampled(self, targets: AnyArray, seed: int) -> tuple[AnyArray, AnyArray]:
        """Samples the mixture (Eq. 3) and ranks what comes.

        Args:
            targets: wrenches (N, 6) [N, N m].
            seed: of the samples.

        Returns:
            Raw candidates (N, K, n, 3), best first, and normalized targets (N, 6) for `_score`.
        """
        std = self.normalization.std
        normalized = ((targets - self.surrogate.bias) / std).astype(np.float32)
        mixture = self._predict((targets - self.normalization.mean) / std)
        sampled = to_command(self._draw(mixture, seed), *self.limits)
        sampled = self._commands.feasible(sampled)
        if self._by_likelihood:
            score = -mixture.log_prob(to_normalized(sampled, *self.limits)).sum(-1)
        else:
            score = self._score(sampled, normalized)
        return _take(sampled, np.argsort(score, axis=1, kind="stable")), normalized

    def _predict(self, centred: AnyArray) -> Mixture:
        """The network's mixture for normalized, centred targets (N, 6)."""
        x = np.repeat(self._features[None], len(centred), axis=0)
        return self.config(self._network, x, centred.astype(np.float32))

    def _draw(self, mixture: Mixture, seed: int) -> AnyArray:
        """Candidates (N, K, n, 3) in normalized coordinates."""
        rows, n, _, _ = mixture.mean.shape
        k = self.settings.n_candidates
        rng = np.random.default_rng(seed)
        if self.settings.mean_only:
            return np.asarray(mixture.expected()[:, None])
        if self.settings.warm_start == "random":
            return np.float32(2.0) * rng.random((rows, k, n, 3), dtype=np.float32) - np.float32(1.0)
        uniform = rng.random((rows, n, k), dtype=np.float32)
        normal = rng.standard_normal((rows, n, k, 3), dtype=np.float32)
        return np.asarray(mixture.sample(uniform, normal, self.settings.temperature))

    def _score(self, command: AnyArray, target: AnyArray) -> AnyArray:
        """Returns J = J_norm (Eq. 8) + gamma J_en (Eq. 9), by the surrogate, (N, K).

        Args:
            command: (N, K, n, 3).
            target: normalized targets (N, 6).
        """
        rows, k, n, _ = command.shape
        flat = command.reshape(-1, n, 3)
        force = self.surrogate.force(flat).reshape(rows, k, -1)
        error = force @ self._effectiveness - target[:, None]
        effort = self._effort(flat).reshape(rows, k)
        return np.asarray(np.einsum("rki,rki->rk", error, error) + self.settings.gamma * effort)

    def _refine(self, command: AnyArray, target: AnyArray) -> AnyArray:
        """Refined commands (N, K, n, 3), inside the limits."""
        if self.settings.refinement == "none":
            return command
        shape = command.shape
        steps = self.settings.n_steps
        flat = command.reshape(-1, *shape[2:])
        targets = np.repeat(target, shape[1], axis=0)
        parts = [self._adam(flat[k], targets[k], steps) for k in blocks_of(len(flat))]
        return np.concatenate(parts).reshape(shape)

    def _adam(self, command: AnyArray, target: AnyArray, steps: int) -> AnyArray:
        """Adam on J for commands (R, n, 3) and normalized targets (R, 6); the best step of each.

        It works in normalized coordinates, inside the limits, with a step that falls linearly. Zero
        directions that turn fully go on beyond the seam.
        """
        lower, upper = self.limits
        x = to_normalized(command, lower, upper)
        half = np.float32(0.5) * (upper - lower)
        # Kingma and Ba's m, v, beta_1 and beta_2.
        m = np.zeros_like(x)
        v = np.zeros_like(x)
        beta_1, beta_2 = ADAM_DECAY
        best = x.copy()
        least = np.full(len(x), np.inf, np.float32)
        for step in range(steps + 1):
            score, jacobian = self._score_and_gradient(to_command(x, lower, upper), target)
            better = score < least
            best[better] = x[better]
            least[better] = score[better]
            if step == steps:
                break
            gradient = half * jacobian
            m += (1.0 - beta_1) * (gradient - m)
            v += (1.0 - beta_2) * (gradient * gradient - v)
            rate = ADAM_RATE * (1.0 - 0.95 * step / steps) / (1.0 - beta_1 ** (step + 1))
            v_hat_root = np.sqrt(v / np.float32(1.0 - beta_2 ** (step + 1)))
            x -= np.float32(rate) * m / (v_hat_root + np.float32(1e-8))
            # A full turn is two units wide.
            wrapped = np.remainder(x[..., 2] + np.float32(1.0), np.float32(2.0)) - np.float32(1.0)
            x[..., 2] = np.where(self.plant.full_turn, wrapped, x[..., 2])
            np.clip(x, -1.0, 1.0, out=x)
        return np.asarray(to_command(best, lower, upper))

    def _score_and_gradient(self, command: AnyArray, target: AnyArray) -> tuple[AnyArray, AnyArray]:
        """J (R,) of commands (R, n, 3), and its derivatives (R, n, 3) by them."""
        rows = len(command)
        effectiveness = self._effectiveness.astype(np.float32)
        force, pull = self.surrogate.force_and_pullback(command)
        error = force.reshape(rows, -1) @ effectiveness - target
        gamma = np.float32(self.settings.gamma)
        effort, by_effort = self._effort.with_gradient(command)
        score = np.einsum("ri,ri->r", error, error) + gamma * effort
        return score, pull(2.0 * error @ effectiveness.T) + gamma * by_effort

    def _inside(self, command: AnyArray) -> Array:
        """Commands in double precision, inside the limits to the last bit."""
        return np.clip(command.astype(np.float64), self.layout.lower, self.layout.upper)

    def _candidates(self, command: AnyArray, target: AnyArray, source: str) -> Candidates:
        """Candidates (K, n, 3) of a single target (6,), in their order."""
        wrench = self.surrogate.wrench(command).astype(np.float64)
        error = np.linalg.norm((wrench - target) / self.scale, axis=-1)
        inside = self._inside(command)
        return Candidates(
            inside, wrench, error, *costs(self.layout, inside), (source,) * len(command)
        )


def _take(command: AnyArray, index: AnyArray) -> AnyArray:
    """Of commands (N, K, n, 3) those with the numbers (N, k)."""
    return np.asarray(np.take_along_axis(command, index[..., None, None], axis=1))
