"""What can be set of method `paper`."""

from dataclasses import dataclass

from finlab.allocation.settings import MOST_CANDIDATES, Settings, choice, number, switch

STEPS = 160
"""Steps of Adam."""


@dataclass(frozen=True)
class PaperSettings(Settings):
    """The stages of the paper's pipeline.

    What the paper does not print is a choice made here: gamma and the weights of J_en, Adam's rate, the
    number of refined candidates and steps, that the best step is kept, and that zero directions turn on
    beyond the seam.
    """

    n_candidates: int = number(64, 1, MOST_CANDIDATES, "candidates K drawn from the mixture")
    temperature: float = number(0.02, 0.0, 100.0, "T of the sampling; 0.02 in the paper")
    gamma: float = number(1e-4, 0.0, 1e6, "weight of the effort in J = J_norm + gamma J_en")
    n_refined: int = number(4, 1, 256, "best-ranked candidates that are refined")
    refinement: str = choice("adam", ("none", "adam"), "how candidates are refined; none is an ablation")
    n_steps: int = number(STEPS, 0, 10_000, "steps of the refinement")
    warm_start: str = choice("mdn", ("mdn", "random"), "where candidates come from; random is an ablation")
    ranking: str = choice("physics", ("physics", "nll"), "by J, or by likelihood, which is an ablation")
    mean_only: bool = switch(False, "take the mixture's mean and nothing else, which is an ablation")
