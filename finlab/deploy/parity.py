"""Does the runtime answer as the library? Cases written by the one, answered again by the other.

python -m finlab.deploy.parity write cases.jsonl --cases 10000    # where finlab is installed whole
python -m finlab.deploy.parity compare cases.jsonl BUNDLE         # where only numpy and onnxruntime are
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.deploy.bundle_file import read_bundle
from finlab.deploy.runtime import Runtime
from finlab.layout import Layout, layout_to_dict, parse_layout, random_layout

Array = NDArray[np.float64]

TOLERANCE = 1e-4
"""Largest difference of a command [rad, Hz, rad] that counts as the same answer."""
PER_LAYOUT = 10
"""Cases on each random layout."""


class Case(NamedTuple):
    """One question and the library's answer."""

    layout: Layout
    """A random layout of 2 to 8 fins."""
    options: dict[str, Any]
    """Arguments of `allocate`: wrench, and failed, previous or policy in some cases."""
    command: Array
    """The library's answer (n, 3), NaN for failed fins."""


def random_cases(count: int, seed: int = 0) -> Iterator[Case]:
    """Cases of the shipped checkpoint: reachable targets, failures, previous commands, far targets."""
    import finlab

    allocator = finlab.load_allocator()
    rng = np.random.default_rng([95_000, seed])
    layout, previous = None, None
    for i in range(count):
        if i % PER_LAYOUT == 0:
            layout, previous = random_layout(rng, n_fins=(2, 8), limits="mixed"), None
        assert layout is not None
        options = _options(rng, layout, i % 5, previous)
        command = allocator.allocate(layout, **options).command
        previous = command
        yield Case(layout, options, command)


def difference(a: Array, b: Array) -> float:
    """Largest difference between two commands (n, 3); zero directions are angles."""
    apart = np.abs(a - b)
    apart[:, 2] = np.minimum(apart[:, 2], 2 * np.pi - apart[:, 2])
    if not np.array_equal(np.isnan(a), np.isnan(b)):
        return float("inf")
    return float(np.nanmax(apart))


def answer_again(runtime: Runtime, case: Case) -> Array:
    """The runtime's answer to a case, on the case's own layout."""
    return runtime.allocator.allocate(case.layout, **case.options).command


def _options(rng: np.random.Generator, layout: Layout, kind: int, previous: Array | None) -> dict[str, Any]:
    """Arguments of one case: plain, a fin lost, after another, out of reach under a policy, two fins lost."""
    lower = layout.lower
    upper = layout.upper
    command = lower + rng.random((layout.n_fins, 3)) * (upper - lower)
    thrust = 4.7 * (np.sin(command[:, 0]) * command[:, 1]) ** 2
    angle = layout.mounting_angle
    c, s = thrust * np.cos(command[:, 2]), thrust * np.sin(command[:, 2])
    force = np.stack([-np.sin(angle) * c, np.cos(angle) * c, s], axis=-1)
    torque = np.cross([fin.position for fin in layout.fins], force)
    options: dict[str, Any] = {"wrench": [*force.sum(0).tolist(), *torque.sum(0).tolist()]}
    if kind in (1, 4) and layout.n_fins > kind // 2:
        lost = rng.permutation(layout.n_fins)[: 1 if kind == 1 or layout.n_fins < 3 else 2]
        options["failed"] = [layout.names[i] for i in lost]
    if kind == 2 and previous is not None:
        options["previous"] = previous.tolist()
    if kind == 3:
        options["wrench"] = [4.0 * value for value in options["wrench"]]
        options["policy"] = str(rng.choice(["closest", "direction", "priority"]))
    return options


def _write(path: Path, count: int) -> None:
    with path.open("w") as file:
        for case in random_cases(count):
            # JSON knows NaN by Python's own name only, which is all that reads this file.
            values: dict[str, Any] = {"layout": layout_to_dict(case.layout), "options": case.options}
            # A layout file's degrees would move an angle by its last bit, and an answer by more than that.
            values["angles"] = [fin.mounting_angle for fin in case.layout.fins]
            file.write(json.dumps(values | {"command": case.command.tolist()}) + "\n")
    print(f"{path}: {count} cases")


def _compare(path: Path, bundle: str, engine: str) -> int:
    runtime = Runtime(read_bundle(bundle), engine)
    apart = []
    with path.open() as file:
        for line in file:
            values = json.loads(line)
            layout = parse_layout(values["layout"])
            pairs = zip(layout.fins, values["angles"], strict=True)
            layout = replace(layout, fins=tuple(replace(fin, mounting_angle=a) for fin, a in pairs))
            case = Case(layout, values["options"], np.array(values["command"]))
            apart.append(difference(answer_again(runtime, case), case.command))
    same = np.array(apart) <= TOLERANCE
    loaded = [name for name in ("torch", "scipy", "viser", "matplotlib") if name in sys.modules]
    print(
        f"parity, engine {engine}: {same.sum()} of {len(same)} answers within {TOLERANCE:g}, "
        f"largest difference {max(apart):.2g}, median {np.median(apart):.2g}; "
        f"heavy packages loaded: {', '.join(loaded) or 'none'}"
    )
    return 0 if same.all() else 1


def main() -> int:
    """See the module."""
    parser = argparse.ArgumentParser("python -m finlab.deploy.parity", description=__doc__)
    parser.add_argument("verb", choices=("write", "compare"))
    parser.add_argument("file", type=Path)
    parser.add_argument("bundle", nargs="?")
    parser.add_argument("--cases", type=int, default=10_000)
    parser.add_argument("--engine", choices=("numpy", "onnx"), default="numpy")
    arguments = parser.parse_args()
    if arguments.verb == "write":
        _write(arguments.file, arguments.cases)
        return 0
    return _compare(arguments.file, arguments.bundle, arguments.engine)


if __name__ == "__main__":
    sys.exit(main())
