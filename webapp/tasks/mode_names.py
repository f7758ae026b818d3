"""Names that tell an answer's modes apart; what counts as one is for `finlab.allocation.modes` to say."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocation import Allocation
from finlab.allocation.modes import Mode, ModeSignature, find_modes, force_sizes, same_signature
from finlab.allocation.solution import Candidates
from webapp.markup.words import OWN as OWN
from webapp.markup.words import fins_words
from webapp.theme import MODE_COLORS

MAX_SHOWN = len(MODE_COLORS)
"""Modes that are shown, each in its own colour; a robot with many fins has dozens, the last ones dear."""


class NamedMode(NamedTuple):
    """One way to deliver the wrench, as people call it."""

    mode: Mode
    name: str
    """What makes it different from the others that are shown."""


@dataclass(frozen=True, eq=False)
class Modes:
    """The modes of an answer, as the page lists them."""

    shown: tuple[NamedMode, ...]
    """The first `MAX_SHOWN` of them, the best one first, no two of the same name."""
    count: int
    samples: Candidates | None = None
    """What a network proposed, before it was refined."""
    of_samples: NDArray[np.intp] | None = None
    """For each sample (K,) the shown mode that its component led to, -1 where that is none of them; None
    where there are no samples."""


NO_MODES = Modes((), 0)


def listed_modes(modes: tuple[Mode, ...], samples: Candidates | None) -> Modes:
    """Modes with names, and which of them each raw sample's component led to."""
    shown = named_modes(modes)
    return Modes(shown, len(modes), samples, None if samples is None else led_to(samples, shown))


def known_modes(answer: Allocation) -> tuple[Mode, ...]:
    """The modes among the candidates that an answer has refined anyway: a few, but they cost no time."""
    return () if answer.candidates is None else modes_of(answer, answer.candidates)


def modes_of(answer: Allocation, candidates: Candidates) -> tuple[Mode, ...]:
    """The modes among candidates for the question of an answer."""
    layout = answer.layout
    return find_modes(candidates, force_sizes(layout, candidates.command), layout.lower, layout.upper)


def named_modes(modes: tuple[Mode, ...]) -> tuple[NamedMode, ...]:
    """The first `MAX_SHOWN` modes with their names, no two alike."""
    shown = modes[:MAX_SHOWN]
    names = _names([mode.signature for mode in shown])
    return tuple(NamedMode(mode, name) for mode, name in zip(shown, names, strict=True))


def same_mode(wanted: Mode, modes: tuple[NamedMode, ...]) -> int:
    """The place of a mode that is known from another list; 0, the best one, where it is not there."""
    places = (k for k, (mode, _) in enumerate(modes) if same_signature(mode.signature, wanted.signature))
    return next(places, 0)


def led_to(samples: Candidates, modes: tuple[NamedMode, ...]) -> NDArray[np.intp]:
    """For each raw sample (K,) the first mode that its component led to, -1 where it led to none."""
    places: dict[str, int] = {}
    for k, (mode, _) in enumerate(modes):
        for source in mode.sources:
            places.setdefault(source, k)
    return np.array([places.get(source, -1) for source in samples.source], dtype=np.intp)


def _names(signatures: list[ModeSignature]) -> list[str]:
    """Who rests; modes of the same name are numbered."""
    told = [_resting_words(signature) for signature in signatures]
    places = [told[:k].count(name) + 1 for k, name in enumerate(told)]
    return [f"{name} ({place})" if place > 1 else name for name, place in zip(told, places, strict=True)]


def _resting_words(signature: ModeSignature) -> str:
    if not signature.resting:
        return "all fins push"
    return f"{fins_words(signature.resting)} {'rest' if len(signature.resting) > 1 else 'rests'}"
