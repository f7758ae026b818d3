"""The whole proposal for one layout as an ONNX model: features, network, draws, fin physics and scores.

Made in memory on the robot, from weights that were checked, with the layout and the draws of a seed as
constants. What `proposal.propose` does in a hundred small steps of numpy takes one call.
Commands and forces stand as (3, K, n): one matrix for each of their three numbers.
"""

from __future__ import annotations

import numpy as np

from finlab.allocation.learned.prepared import Prepared
from finlab.allocation.learned.proposal import draws_of_one
from finlab.allocation.learned.settings import Settings
from finlab.deploy.onnx.builder import Builder
from finlab.deploy.onnx.model import Model
from finlab.deploy.onnx.single_network import TURN, add_hidden, add_mixture
from finlab.inference.learned_fin import FORCE_UNIT, REFERENCE
from finlab.inference.weights import TrainedWeights
from finlab.physics.energy import DEFAULT_WEIGHTS, energy_scale

OUTPUTS = ("command", "component", "wrench", "error", "thrust", "energy")
"""In the order of `Proposal`."""


def proposal_model(weights: TrainedWeights, prepared: Prepared, settings: Settings, seed: int) -> Model:
    """One target in, K candidates with their scores out."""
    g = Builder()
    n, k, m = len(prepared.lower), settings.n_candidates, weights.check_network().n_components
    static = prepared.geometry.static[0]
    hidden = add_hidden(g, _features(g, prepared, n), static, weights.network, weights.check_network().heads)
    mixture = add_mixture(g, hidden, weights.network, m, prepared.lower, prepared.upper)
    x = _candidates(g, mixture, settings, n, m, seed)
    half = 0.5 * (prepared.upper - prepared.lower)
    x = g.add("Mul", x, g.weight("half range", _rows(half)))
    x = _clamp(g, g.add("Add", x, g.weight("middle", _rows(half + prepared.lower))), prepared)
    g.add("Transpose", x, perm=(1, 2, 0), name="command")
    beat, direction = g.add_many("Split", x, g.integers([2, 1]), names=("beat", "direction"), axis=0)
    product = g.add("ReduceProd", beat, axes=(0,), keepdims=1)
    force = _force(g, beat, direction, product, weights, k, n)
    columns = g.weight("columns", prepared.commands.columns.swapaxes(0, 1))
    g.add("ReduceSum", g.add("MatMul", force, columns), g.integers([0]), keepdims=0, name="wrench")
    g.add("ReduceL2", g.add("Sub", "wrench", "wanted"), axes=(1,), keepdims=0, name="error")
    _energy(g, x, product, prepared)
    shapes: dict[str, tuple[int | str, ...]] = {
        "command": (k, n, 3),
        "component": (k,),
        "wrench": (k, 6),
        "error": (k,),
        "thrust": (k, n),
        "energy": (k,),
    }
    return g.model("finlab proposal", {"target": (1, 6), "wanted": (1, 6)}, shapes, {}, "")


def _rows(values: np.ndarray) -> np.ndarray:
    """What belongs to each command (n, 3), to be set beside (3, K, n)."""
    return values.T[:, None]


def _features(g: Builder, prepared: Prepared, n: int) -> str:
    """Node features (n, 7) that depend on the target, as in `fin_frame_features`."""
    geometry = prepared.geometry
    shares = geometry.solver[0].T.reshape(6, n, 2)
    projections = 0.1 * geometry.columns[0].reshape(6, n, 2)
    both = np.concatenate([shares, projections], axis=-1).reshape(6, 4 * n)
    pair = g.add("Reshape", g.add("MatMul", "target", g.weight("solver", both)), g.integers([n, 4]))
    share, _ = g.add_many("Split", pair, g.integers([2, 2]), names=("share", "projection"), axis=1)
    size = g.add("ReduceSumSquare", share, axes=(1,), keepdims=1)
    size = g.add("Sqrt", g.add("Add", size, g.number(1e-8)))
    root = g.add("Sqrt", g.add("Sqrt", size))
    return g.add("Concat", pair, g.add("Div", share, size), root, axis=1)


def _candidates(
    g: Builder, mixture: tuple[str, str, str], settings: Settings, n: int, m: int, seed: int
) -> str:
    """Normalized commands (3, K, n): the components' means, then draws; also the output `component`."""
    weight, mean, std = mixture
    k = settings.n_candidates
    uniform, normal = draws_of_one(seed, k - m, n)
    ladder = g.weight("ladder", np.triu(np.ones((m, m))))  # sums of the weights so far, as a product
    so_far = g.add("MatMul", weight, ladder)
    so_far, total = g.add_many("Split", so_far, g.integers([m - 1, 1]), names=("so far", "total"), axis=1)
    draw = g.add("Mul", g.weight("uniform", uniform[0]), total)
    passed = g.add("Cast", g.add("Greater", draw, so_far), to=1)  # (E, M - 1)
    ones, zeros = (g.weight(name, np.full((k - m, 1), v)) for name, v in (("ones", 1.0), ("zeros", 0.0)))
    # 1 at the component that was drawn, 0 at the others.
    chosen = g.add("Sub", g.add("Concat", ones, passed, axis=1), g.add("Concat", passed, zeros, axis=1))
    noise = np.moveaxis(normal[0], -1, 0) * np.float32(np.sqrt(settings.temperature))
    spread = g.add("Mul", g.weight("normal", noise), g.add("MatMul", chosen, std))
    drawn = g.add("Add", spread, g.add("MatMul", chosen, mean))
    numbers = g.weight("numbers", np.arange(m, dtype=np.float32))
    g.add("Concat", numbers, g.add("MatMul", chosen, numbers), axis=0, name="component")
    return g.add("Concat", mean, drawn, axis=1)


def _clamp(g: Builder, x: str, prepared: Prepared) -> str:
    """Commands (3, K, n) inside the limits, zero directions wrapped first."""
    middle = 0.5 * (prepared.lower[:, 2] + prepared.upper[:, 2])
    beat, direction = g.add_many("Split", x, g.integers([2, 1]), names=("size", "turned"), axis=0)
    ahead = g.add("Sub", direction, g.weight("behind", middle - np.pi))
    turns = g.add("Floor", g.add("Mul", ahead, g.number(1.0 / TURN)))
    direction = g.add("Sub", direction, g.add("Mul", turns, g.number(TURN)))
    whole = g.add("Concat", beat, direction, axis=0)
    lower, upper = (g.weight(name, _rows(getattr(prepared, name))) for name in ("lower", "upper"))
    return g.add("Min", g.add("Max", whole, lower), upper)


def _force(
    g: Builder, beat: str, direction: str, product: str, weights: TrainedWeights, k: int, n: int
) -> str:
    """Forces (3, K, n) in the fins' own frames, as in `LearnedFin`; also the output `thrust`."""
    c, s = g.add("Cos", direction), g.add("Sin", direction)
    hidden = g.add("Concat", beat, c, s, axis=0)
    hidden = g.add("Reshape", hidden, g.integers([4, k * n]))
    state = {name: array.astype(np.float64) for name, array in weights.surrogate.items()}
    layers = sorted({int(name.split(".")[1]) for name in state})
    first, last = f"net.{layers[0]}", f"net.{layers[-1]}"
    # How commands are scaled and shifted goes into the first layer, how forces are into the last.
    a0, f0 = REFERENCE
    state[f"{first}.bias"] = state[f"{first}.bias"] - 0.5 * state[f"{first}.weight"][:, :2].sum(1)
    state[f"{first}.weight"] = state[f"{first}.weight"] / np.array([a0, f0, 1.0, 1.0])
    for part in ("weight", "bias"):
        state[f"{last}.{part}"] = state[f"{last}.{part}"] * (FORCE_UNIT / (a0 * f0) ** 2)
    for i in layers:
        matrix = g.weight(f"net.{i}.weight", state[f"net.{i}.weight"])
        hidden = g.add("Gemm", matrix, hidden, g.weight(f"net.{i}.bias", state[f"net.{i}.bias"][:, None]))
        hidden = hidden if i == layers[-1] else g.add("Tanh", hidden)
    coefficient = g.add("Reshape", hidden, g.integers([3, k, n]))
    scaled = g.add("Mul", coefficient, g.add("Mul", product, product))
    parts = ("shaft", "along", "across")
    shaft, along, across = g.add_many("Split", scaled, g.integers([1, 1, 1]), names=parts, axis=0)
    horizontal = g.add("Sub", g.add("Mul", c, along), g.add("Mul", s, across))
    vertical = g.add("Add", g.add("Mul", s, along), g.add("Mul", c, across))
    planar = g.add("Concat", horizontal, vertical, axis=0)
    g.add("ReduceL2", planar, axes=(0,), keepdims=0, name="thrust")
    return g.add("Concat", shaft, planar, axis=0)


def _energy(g: Builder, x: str, product: str, prepared: Prepared) -> None:
    """The output `energy` (K,) of commands (3, K, n), as in `finlab.physics.energy`."""
    w, scale = DEFAULT_WEIGHTS, energy_scale(prepared.upper)
    root = np.sqrt([w.amplitude, w.frequency, w.zero_direction])
    squares = g.add("Mul", x, g.weight("root weights", _rows(root / scale)))
    squares = g.add("ReduceSumSquare", squares, axes=(0, 2), keepdims=0)
    beats = g.add("Mul", product, g.weight("product weights", w.product / (scale[:, 0] * scale[:, 1])))
    g.add("Add", squares, g.add("ReduceSum", beats, g.integers([0, 2]), keepdims=0), name="energy")
