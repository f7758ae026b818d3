"""`python -m finlab.bench.worker METHOD [--cpu]`: a Python function, or a method of finlab, answers in lines.

A function is handed what its parameters ask for by name: `targets` (N, 6), `layout` (a `finlab.Layout`),
`robot` (the same as plain values of a layout file), `sigma` (6,), `previous` (n, 3) or None.
It returns commands (N, n, 3).
"""

import inspect
import json
import os
import runpy
import sys
import time
from collections.abc import Callable
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.allocation.policy import CLOSEST, Policy
from finlab.arrays import Array
from finlab.bench.protocol import CPU, GREETING
from finlab.errors import DataError, FinlabError
from finlab.evaluation.method_specs import load_method_spec
from finlab.layout import Layout
from finlab.layout.file import parse_layout

KNOWN = ("targets", "layout", "robot", "sigma", "previous")
"""Parameters that a function may have."""


def load_callable(name: str) -> Callable[..., Any]:
    """The function `module:function` or `file.py:function`.

    Raises:
        DataError: there is none, or one of its parameters is none of `KNOWN`.
    """
    place, _, attribute = name.rpartition(":")
    try:
        if place.endswith(".py"):
            sys.path.insert(0, str(Path(place).resolve().parent))
            found = runpy.run_path(place).get(attribute)
        else:
            sys.path.insert(0, os.getcwd())
            found = getattr(import_module(place), attribute, None)
    except Exception as error:  # a stranger's file may fail in any way
        raise DataError(f"{place}: cannot be loaded: {type(error).__name__}: {error}") from None
    if not callable(found):
        raise DataError(f"{place}: holds no function {attribute!r}")
    try:
        parameters = inspect.signature(found).parameters.values()
    except ValueError:
        raise DataError(f"{name}: its parameters are not known; wrap it in a function") from None
    if unknown := [p.name for p in parameters if p.default is p.empty and p.name not in KNOWN]:
        raise DataError(f"{name}: expected parameters among {', '.join(KNOWN)}, got {unknown[0]!r}")
    method: Callable[..., Any] = found
    return method


def finlab_method(name: str) -> Callable[..., Array]:
    """One of finlab's methods as a function, told what the benchmark divides errors by, where it
    can weigh axes."""
    method = load_method_spec(name)
    made: dict[Layout, tuple[Allocator, Policy]] = {}

    def answer(layout: Layout, targets: Array, sigma: Array, previous: Array | None) -> Array:
        if layout not in made:
            allocator = method.on(layout)
            weighs = Policy(axis_weights=tuple((allocator.scale / sigma).tolist()))
            made[layout] = allocator, weighs if method.choice.kind.every_policy else CLOSEST
        allocator, policy = made[layout]
        return allocator.allocate(targets[0], policy=policy, previous=previous).command[None]

    return answer


@lru_cache(2)
def _layout(description: str) -> Layout:
    return parse_layout(json.loads(description))


def answers(method: Callable[..., Any], asked: dict[str, Any], clock: Callable[[], float]) -> dict[str, Any]:
    """The answer to one question; only the call itself is timed, by a clock [s]."""
    before = asked["previous"]
    given: dict[str, Any] = {
        "targets": np.array(asked["targets"]),
        "layout": _layout(json.dumps(asked["layout"])),
        "robot": asked["layout"],
        "sigma": np.array(asked["sigma"]),
        "previous": None if before is None else np.array(before),
    }
    wanted = inspect.signature(method).parameters
    if not any(p.kind is p.VAR_KEYWORD for p in wanted.values()):
        given = {name: value for name, value in given.items() if name in wanted}
    begin = clock()
    commands = method(**given)
    seconds = clock() - begin
    return {"id": asked["id"], "commands": np.asarray(commands, np.float64).tolist(), "seconds": seconds}


def main(name: str, *options: str) -> int:
    """Answer lines on stdin until they end; what the method prints goes to stderr."""
    with os.fdopen(os.dup(1), "w", encoding="utf-8") as out:
        os.dup2(2, 1)

        def say(what: dict[str, Any]) -> None:
            print(json.dumps(what), file=out, flush=True)

        try:
            method = load_callable(name) if ":" in name else finlab_method(name)
        except (FinlabError, ModuleNotFoundError) as error:
            say({"id": GREETING, "error": str(error)})
            return 2
        say({"id": GREETING, "commands": []})
        clock = time.process_time if CPU in options else time.perf_counter
        for line in sys.stdin:
            asked = json.loads(line)
            try:
                say(answers(method, asked, clock))
            except Exception as error:  # whatever a method raises is one failure of it
                say({"id": asked["id"], "error": f"{type(error).__name__}: {error}"})
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
