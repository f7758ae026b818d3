"""What fins take from each other and from the robot's speed, as a fit to a swim has found it.

The share of its own thrust that fin i keeps is

    1 - sum over j of (a_ij B_k(c_ij) + b_ij B_4k(c_ij)) T_j / (T_j + T_0) - (p tanh J_i + q tanh^2 J_i)

with T_j the thrust of fin j by itself, c_ij the cosine between its jet (against its thrust) and the way from
j to i, B_k(c) = exp(k (c - 1)), and J_i the fin's speed through the water along its thrust over that of its
tip. `finlab.physics.coupling` computes it.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Annotated

from msgspec import Meta

from finlab.errors import LayoutError
from finlab.layout.checked import Checked, Name

MAX_SHARE = 2.0
Share = Annotated[float, Meta(ge=-MAX_SHARE, le=MAX_SHARE)]
"""A coefficient of a share of thrust."""
Two = Meta(min_length=2, max_length=2)


@dataclass(frozen=True)
class Jet(Checked):
    """What the jet of one fin takes from another. Checked on construction."""

    source: Name
    """Name of the fin that throws the water."""
    target: Name
    """Name of the fin that the water meets."""
    share: Annotated[tuple[Share, ...], Two]
    """Share of the target's thrust that a wide and a narrow jet (a, b) take where it lies in their middle."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.source == self.target:
            raise LayoutError(f"{self.source!r} does not lie in its own jet; name two fins", "target")


@dataclass(frozen=True)
class Interaction(Checked):
    """All that a robot's fins take from each other. Checked on construction."""

    jets: tuple[Jet, ...] = ()
    """What jets take; pairs that are not named take nothing."""
    half_thrust_n: Annotated[float, Meta(ge=1e-6, le=1e4)] = 0.5
    """Thrust T_0 [N] at which a jet takes half of what a very strong one takes."""
    narrowness: Annotated[float, Meta(ge=0.0, le=100.0)] = 2.0
    """How narrow the wide jet is, k: 2 falls to 1 / e at 60 degrees, 4 at 41. The narrow one has four times
    as much."""
    inflow: Annotated[tuple[Share, ...], Two] = (0.0, 0.0)
    """Coefficients p and q of what speed through the water takes."""

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "jets", tuple(self.jets))
        pairs = [(jet.source, jet.target) for jet in self.jets]
        for i, pair in enumerate(pairs):
            if pair in pairs[:i]:
                raise LayoutError(f"the jet of {pair[0]!r} on {pair[1]!r} is given twice", f"jets[{i}]")

    def renamed(self, old: str, new: str) -> "Interaction":
        """The same with another name for one fin."""

        def name(known: str) -> str:
            return new if known == old else known

        return replace(
            self, jets=tuple(Jet(name(jet.source), name(jet.target), jet.share) for jet in self.jets)
        )

    def among(self, names: Iterable[str]) -> "Interaction":
        """What is left of it among the fins of these names."""
        left = set(names)
        jets = tuple(jet for jet in self.jets if jet.source in left and jet.target in left)
        return self if len(jets) == len(self.jets) else replace(self, jets=jets)
