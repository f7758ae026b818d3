"""A request of `finlab-runtime serve`: one JSON object in a line, read strictly."""

import json
import math
from collections.abc import Mapping
from typing import Any, NoReturn

from finlab.errors import CommandError

MAX_LINE = 65_536
"""Longest request that is read [bytes]."""
MAX_ID = 1_000
"""Longest `id`, as JSON [characters]."""
KEYS = ("wrench", "id", "failed", "policy", "reference", "flow")
"""What a request may hold."""


def parse_request(line: bytes) -> Mapping[str, Any]:
    """A request, checked as far as the allocator does not check it itself.

    Raises:
        CommandError: it is no JSON object of known keys, or its `id` is too long to be sent back.
    """
    if len(line) > MAX_LINE:
        raise CommandError(f"request: longer than {MAX_LINE} bytes")
    try:
        request = json.loads(line, parse_constant=_no_number, parse_float=_finite, parse_int=_whole)
    except (ValueError, RecursionError) as error:
        reason = f"; {error}" if isinstance(error, _NotFinite) else ""
        raise CommandError(f"request: expected one JSON object in a line{reason}") from None
    if not isinstance(request, dict) or "wrench" not in request:
        raise CommandError('request: expected {"wrench": [Fx, Fy, Fz, Tx, Ty, Tz]}')
    if unknown := [key for key in request if key not in KEYS]:
        raise CommandError(f"request: unknown key {unknown[0]!r:.40}, expected {', '.join(KEYS)}")
    if len(json.dumps(request.get("id"))) > MAX_ID:
        raise CommandError(f"id: longer than {MAX_ID} characters")
    failed = request.get("failed", [])
    if not isinstance(failed, list) or not all(isinstance(name, str) for name in failed):
        raise CommandError("failed: expected a list of fin names")
    if not isinstance(request.get("policy", ""), str):
        raise CommandError("policy: expected a name")
    return request


class _NotFinite(ValueError):
    """A number that JSON does not have, or that no double holds."""


def _no_number(name: str) -> NoReturn:
    raise _NotFinite(f"{name} is no number in JSON")


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise _NotFinite(f"{text:.40} is too large")
    return value


def _whole(text: str) -> int:
    _finite(text)
    return int(text)
