"""The distinct ways in which an answer's candidates deliver the wrench, and names that tell them apart."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocation import Candidates
from webapp.figures import listed

Array = NDArray[np.float64]

RESTING = 0.15
"""Share of the strongest fin's thrust below which a fin counts as resting: how it does so does not matter."""
SAME_DIRECTION = np.radians(25.0)
"""Zero directions closer than this are the same [rad]."""
SAME_SIZE = 0.25
"""Thrusts, and ratios of amplitude to frequency, whose logarithms differ by less are the same."""


@dataclass(frozen=True)
class Mode:
    """Candidates that do the same, as people see it."""

    index: int
    """The best of them, as its place among the candidates."""
    size: int
    """How many candidates it stands for."""
    name: str
    """What makes it different from the other modes."""


@dataclass(frozen=True)
class _Way:
    """What matters of one command: numbers per fin (n,), NaN where the fin rests or has failed."""

    resting: tuple[int, ...]
    thrust: Array
    direction: Array
    style: Array


def distinct_modes(candidates: Candidates | None) -> tuple[Mode, ...]:
    """The modes, best first; of candidates that do the same the best one stands for all."""
    if candidates is None:
        return ()
    ways: list[_Way] = []
    members: list[list[int]] = []
    for k, command in enumerate(candidates.command):
        way = _way(command)
        home = next((i for i, known in enumerate(ways) if _same(known, way)), None)
        if home is None:
            ways.append(way)
            members.append([k])
        else:
            members[home].append(k)
    return tuple(
        Mode(member[0], len(member), name) for member, name in zip(members, _names(ways), strict=True)
    )


def nearest_modes(
    samples: Candidates | None, candidates: Candidates | None, modes: tuple[Mode, ...]
) -> NDArray[np.intp] | None:
    """For each raw sample (K,) the mode whose thrusts are nearest to its own; None where there are none."""
    if samples is None or candidates is None or not modes:
        return None
    raw = _push(samples.command)
    refined = _push(candidates.command[[mode.index for mode in modes]])
    gap = np.abs(raw[:, None] - refined[None]) ** 2
    return np.asarray(np.argmin(gap.sum(axis=-1), axis=1))


def _push(command: Array) -> NDArray[np.complex128]:
    """Thrusts (..., n) in each fin's plane as complex numbers, up to a common factor; 0 for failed fins."""
    strength = np.sin(command[..., 0]) ** 2 * command[..., 1] ** 2
    return np.asarray(np.nan_to_num(strength * np.exp(1j * command[..., 2])))


def _way(command: Array) -> _Way:
    with np.errstate(divide="ignore"):
        thrust = 2 * np.log(np.sin(command[:, 0])) + 2 * np.log(command[:, 1])  # grows with sin^2(A) f^2
        style = np.log(command[:, 0]) - np.log(command[:, 1])
    resting = np.isfinite(thrust) & (thrust < np.nanmax(thrust) + np.log(RESTING))
    pushes = np.isfinite(thrust) & ~resting
    values = [np.where(pushes, v, np.nan) for v in (thrust, command[:, 2], style)]
    return _Way(tuple(int(i) for i in np.flatnonzero(resting)), *values)


def _differences(a: _Way, b: _Way) -> Array:
    """How `b` differs from `a` (3, n) in direction, thrust and style; 1 is what counts as different."""
    turn = np.angle(np.exp(1j * (b.direction - a.direction))) / SAME_DIRECTION
    rest = np.array([b.thrust - a.thrust, b.style - a.style]) / SAME_SIZE
    return np.nan_to_num(np.concatenate([turn[None], rest]))


def _same(a: _Way, b: _Way) -> bool:
    return a.resting == b.resting and bool((np.abs(_differences(a, b)) < 1.0).all())


def _names(ways: list[_Way]) -> list[str]:
    """Who rests; where that is not enough, the largest differences from the first mode with the same name."""
    names: list[str] = []
    firsts: dict[str, _Way] = {}
    for way in ways:
        base = _resting_words(way)
        name = base
        if base in firsts:
            told = _difference_words(firsts[base], way)
            # One difference is enough to tell two modes apart; a third one may need more, or a number.
            tries = [", ".join([base, *told[:n]]) for n in range(1, len(told) + 1)]
            tries += [f"{tries[-1] if tries else base} ({k})" for k in range(2, len(ways) + 2)]
            name = next(text for text in tries if text not in names)
        else:
            firsts[base] = way
        names.append(name)
    return names


def _resting_words(way: _Way) -> str:
    if not way.resting:
        return "all fins push"
    several = len(way.resting) > 1
    fins = listed([str(i + 1) for i in way.resting])
    return f"fins {fins} rest" if several else f"fin {fins} rests"


def _difference_words(first: _Way, way: _Way) -> list[str]:
    """What differs, the largest difference first."""
    differences = _differences(first, way)
    words = []
    for flat in np.argsort(-np.abs(differences), axis=None):
        kind, fin = divmod(int(flat), differences.shape[1])
        value = float(differences[kind, fin])
        if abs(value) < 1.0:
            break
        if kind == 0:
            degrees = round(np.degrees(value * SAME_DIRECTION))
            words.append(f"fin {fin + 1} {'reversed' if abs(degrees) > 135 else f'turned {degrees:+d}°'}")
        elif kind == 1:
            words.append(f"fin {fin + 1} pushes {'harder' if value > 0 else 'less'}")
        else:
            words.append(f"fin {fin + 1} {'wider and slower' if value > 0 else 'narrower and quicker'}")
    return [word.replace("-", "−") for word in words]
