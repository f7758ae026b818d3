"""What is said between the benchmark and a method: one JSON object per line, over stdin and stdout.

The benchmark asks, the method answers before the next question comes:

    {"id": 7, "layout": {...}, "sigma": [6 numbers], "targets": [[6 numbers], ...], "previous": null}
    {"id": 7, "commands": [[[A, f, phi], ...], ...]}

`layout` is a layout file as JSON. `previous` is the command of the tick before on paths, one [A, f, phi] per
fin. There is one command for each target, in it one [rad, Hz, rad] for each fin. A method without an answer
says `{"id": 7, "error": "why"}`. The last line is followed by the end of the input; the method then ends.
"""

import json
from typing import Any, NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.physics import Plant

TOLERANCE = 1e-6
"""By how much a command may leave its limits, as a share of what they span and of one [rad, Hz, rad]."""
FAILURES = ("exception", "malformed", "not finite", "out of limits", "late", "died")
"""What may be wrong with an answer: the method said so; it is no answer to the question; it holds NaN or an
infinity; a command leaves the fin's limits; it came too late; or the process ended."""

GREETING = 0
"""Number of the answer with which finlab's own worker says that it is ready."""

CPU = "--cpu"
"""Tells the worker to time calls by the processor's time."""


class Failure(NamedTuple):
    """Why there is no answer."""

    kind: str
    """One of `FAILURES`."""
    words: str
    """What was seen."""


def question(number: int, layout: dict[str, Any], sigma: Array, target: Array, previous: Array | None) -> str:
    """A line that asks for a target (6,) on a layout, with the command (n, 3) of the tick before."""
    before = None if previous is None else previous.tolist()
    asked = {"layout": layout, "sigma": sigma.tolist(), "targets": [target.tolist()], "previous": before}
    return json.dumps({"id": number, **asked}) + "\n"


def parse_answer(line: bytes, number: int) -> dict[str, Any] | Failure:
    """The object in a line, if it answers question `number`."""
    try:
        answer = json.loads(line)
    except (ValueError, RecursionError):
        return Failure("malformed", f"expected a JSON object in one line, got {line[:80]!r}")
    if not isinstance(answer, dict) or answer.get("id") != number:
        return Failure("malformed", f"expected an object with id {number}, got {line[:80]!r}")
    if "commands" not in answer:
        return Failure("exception", str(answer.get("error", "neither commands nor an error"))[:300])
    return answer


def checked_command(answer: dict[str, Any], plant: Plant) -> Array | Failure:
    """The command (n, 3) of an answer, within the limits of a robot's fins.

    Fins that may turn freely may be given any angle.
    """
    try:
        values = np.asarray(answer["commands"], dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return Failure("malformed", "commands: expected numbers, three for each fin")
    if values.shape != (1, plant.n_fins, 3):
        return Failure("malformed", f"commands: expected {(1, plant.n_fins, 3)}, got {values.shape}")
    if not np.isfinite(values).all():
        return Failure("not finite", "commands hold NaN or an infinity")
    within: Array = plant.feasible(values[0])
    away = np.abs(values[0] - within)
    away[plant.full_turn, 2] = 0.0
    room = TOLERANCE * np.maximum(plant.width, 1.0)
    if (away > room).any():
        fin, part = np.unravel_index(int((away - room).argmax()), away.shape)
        what = ("amplitude", "frequency", "zero direction")[part]
        return Failure("out of limits", f"{what} of {plant.layout.names[fin]} by {away.max():.3g}")
    return within
