"""A request of `finlab-runtime serve`: one JSON object in a line, read strictly."""

import json
from typing import Any

from msgspec import Struct

from finlab.errors import CommandError
from finlab.files.guarded import decoded
from finlab.files.plain_values import parse_json
from finlab.files.schema import checked

MAX_LINE = 65_536
"""Longest request that is read [bytes]."""
MAX_ID = 1_000
"""Longest `id`, as JSON [characters]."""


class Request(Struct, forbid_unknown_fields=True):
    """What a request may hold; the allocator checks its arrays."""

    wrench: Any
    id: Any = None
    failed: list[str] = []
    policy: str = "closest"
    reference: Any = None
    flow: Any = None


def parse_request(line: bytes) -> Request:
    """A request, checked as far as the allocator does not check it itself.

    Raises:
        CommandError: it is no JSON object of known keys, or its `id` is too long to be sent back.
    """
    if len(line) > MAX_LINE:
        raise CommandError(f"request: longer than {MAX_LINE} bytes")
    values = parse_json(decoded(line, "request", "JSON", CommandError), "request", CommandError)
    request = checked(values, Request, CommandError, "request")
    if len(json.dumps(request.id)) > MAX_ID:
        raise CommandError(f"id: longer than {MAX_ID} characters")
    return request
