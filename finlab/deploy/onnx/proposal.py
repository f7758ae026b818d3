"""The whole proposal for one layout as an ONNX model: features, network, draws, fin physics and scores.

Made in memory on the robot, from weights that were checked, with the layout and the draws of a seed as
constants. What `finlab.allocation.proposal.propose` does in a hundred small steps of numpy takes one call.
"""

from __future__ import annotations

import numpy as np

from finlab.allocation.energy import DEFAULT_WEIGHTS, energy_scale
from finlab.allocation.pipeline import Settings
from finlab.allocation.prepared import Prepared
from finlab.allocation.proposal import draws_of_one
from finlab.allocation.weights import LearnedWeights
from finlab.deploy.onnx.builder import Builder
from finlab.deploy.onnx.model import Model
from finlab.deploy.onnx.network import add_network
from finlab.deploy.onnx.surrogate import add_fin

OUTPUTS = ("command", "component", "wrench", "error", "thrust", "energy")
"""In the order of `Proposal`."""


def proposal_model(weights: LearnedWeights, prepared: Prepared, settings: Settings, seed: int) -> Model:
    """One target in, K candidates with their scores out."""
    g = Builder()
    n, k, m = len(prepared.lower), settings.n_candidates, weights.n_components
    lower, upper = (g.weight(name, getattr(prepared, name)) for name in ("lower", "upper"))
    _features(g, prepared, n)
    add_network(g, weights.network, weights.heads, m)
    x = _candidates(g, settings, n, m, seed)
    x = g.add("Reshape", x, g.integers([k, n, 3]))
    scale = g.weight("half range", 0.5 * (prepared.upper - prepared.lower))
    x = g.add("Add", g.add("Mul", g.add("Add", x, g.number(1.0)), scale), lower)
    _clamp(g, x, prepared, lower, upper)
    _, horizontal, vertical = add_fin(g, weights.surrogate, weights.reference, weights.force_unit)
    flat = g.add("Reshape", "fin_force", g.integers([k, 3 * n]))
    columns = g.weight("columns", prepared.commands.columns.reshape(3 * n, 6))
    missing = g.add("Sub", g.add("MatMul", flat, columns, name="wrench"), "wanted")
    g.add("Sqrt", _square_sum(g, missing), name="error")
    planar = g.add("Add", g.add("Mul", horizontal, horizontal), g.add("Mul", vertical, vertical))
    g.add("Squeeze", g.add("Sqrt", planar), g.integers([2]), name="thrust")
    _energy(g, prepared)
    shapes: dict[str, tuple[int | str, ...]] = {
        "command": (k, n, 3),
        "component": (k,),
        "wrench": (k, 6),
        "error": (k,),
        "thrust": (k, n),
        "energy": (k,),
    }
    return g.model("finlab proposal", {"target": (1, 6), "wanted": (1, 6)}, shapes, {}, "")


def _features(g: Builder, prepared: Prepared, n: int) -> None:
    """The tensor `features`, as in `finlab.data.features.fin_frame_features`."""
    geometry = prepared.geometry
    share = g.add("MatMul", "target", g.weight("solver", geometry.solver[0].T))
    share = g.add("Reshape", share, g.integers([1, n, 2]))
    size = g.add("ReduceSum", g.add("Mul", share, share), g.integers([2]), keepdims=1)
    size = g.add("Sqrt", g.add("Add", size, g.number(1e-8)))
    projection = g.add("MatMul", "target", g.weight("full wrenches", geometry.columns[0]))
    projection = g.add("Mul", g.add("Reshape", projection, g.integers([1, n, 2])), g.number(0.1))
    unit, root = g.add("Div", share, size), g.add("Sqrt", g.add("Sqrt", size))
    static = g.weight("static", geometry.static)
    g.add("Concat", static, share, unit, root, projection, axis=-1, name="features")


def _candidates(g: Builder, settings: Settings, n: int, m: int, seed: int) -> str:
    """Normalized commands (K, 3 n): the components' means, then draws; also the output `component`."""
    k = settings.n_candidates
    means, spread = (
        g.add("Reshape", g.add("Transpose", name, perm=(0, 2, 1, 3)), g.integers([m, 3 * n]))
        for name in ("mean", "std")
    )
    uniform, normal = draws_of_one(seed, k - m, n)
    ladder = g.weight("ladder", np.triu(np.ones((m, m))))  # sums of the weights so far, as a product
    so_far = g.add("MatMul", "weight", ladder)
    total = g.add("Slice", so_far, g.integers([m - 1]), g.integers([m]), g.integers([1]))
    draw = g.add("Mul", g.weight("uniform", uniform[0]), total)
    passed = g.add("Slice", so_far, g.integers([0]), g.integers([m - 1]), g.integers([1]))
    passed = g.add("Cast", g.add("Greater", draw, passed), to=1)  # (E, M - 1)
    ones, zeros = (g.weight(name, np.full((k - m, 1), v)) for name, v in (("ones", 1.0), ("zeros", 0.0)))
    # 1 at the component that was drawn, 0 at the others.
    chosen = g.add("Sub", g.add("Concat", ones, passed, axis=1), g.add("Concat", passed, zeros, axis=1))
    noise = g.weight("normal", normal[0].reshape(k - m, 3 * n) * np.float32(np.sqrt(settings.temperature)))
    drawn = g.add("Add", g.add("Mul", noise, g.add("MatMul", chosen, spread)), g.add("MatMul", chosen, means))
    numbers = g.weight("numbers", np.arange(m, dtype=np.float32))
    g.add("Concat", numbers, g.add("MatMul", chosen, numbers), axis=0, name="component")
    return g.add("Concat", means, drawn, axis=0)


def _clamp(g: Builder, x: str, prepared: Prepared, lower: str, upper: str) -> None:
    """The tensor `command` (K, n, 3) inside the limits, zero directions wrapped first."""
    middle = 0.5 * (prepared.lower[:, 2:] + prepared.upper[:, 2:])
    beat, direction = g.add_many("Split", x, g.integers([2, 1]), names=("beat", "turned"), axis=-1)
    ahead = g.add("Sub", direction, g.weight("behind", middle - np.pi))
    turns = g.add("Floor", g.add("Div", ahead, g.number(2 * np.pi)))
    ahead = g.add("Sub", ahead, g.add("Mul", turns, g.number(2 * np.pi)))
    direction = g.add("Add", ahead, "behind")
    whole = g.add("Concat", beat, direction, axis=-1)
    g.add("Min", g.add("Max", whole, lower), upper, name="command")


def _energy(g: Builder, prepared: Prepared) -> None:
    """The output `energy` (K,), as in `finlab.allocation.energy`."""
    w = DEFAULT_WEIGHTS
    scaled = g.add("Mul", "command", g.weight("scale", 1.0 / energy_scale(prepared.upper)))
    root = np.sqrt([w.amplitude, w.frequency, w.zero_direction])
    squares = g.add("Mul", scaled, g.weight("root weights", root))
    squares = g.add("ReduceSum", g.add("Mul", squares, squares), g.integers([1, 2]), keepdims=0)
    a, f, _ = g.add_many("Split", scaled, g.integers([1, 1, 1]), names=("sa", "sf", "sd"), axis=-1)
    product = g.add("ReduceSum", g.add("Mul", a, f), g.integers([1, 2]), keepdims=0)
    g.add("Add", squares, g.add("Mul", product, g.number(w.product)), name="energy")


def _square_sum(g: Builder, x: str) -> str:
    return g.add("ReduceSum", g.add("Mul", x, x), g.integers([1]), keepdims=0)
