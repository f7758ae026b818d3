"""Jets by a Bayesian model that is linear in its weights, learned from forward data of many robots.

The wrench that comes beside the forces of a robot is a sum of

- the formula of jets (`finlab.interaction.jets`) with its usual constants, and with each of them
  doubled: what its constants are, and how jets add up where several meet, and
- messages between pairs of actuators, and of the hull to each actuator
  (`finlab.interaction.messages`), whose factors are polynomials of their features: of degree 3 in
  those of a place in the jet and in those of the hull, of degree 2 in all,

- what a flow takes from each actuator: a share of its force by the speed along it over that of its
  jet, and by the square of this ratio, and a force across it by the momentum of the water taken in,

each times a weight. Robots differ, so the weights w of one robot are normal about those of all:
`w = m + L z`, where the latent numbers z of a robot are independent and of variance 1. Training
estimates m and L from many robots (empirical Bayes; `finlab.research.interaction.linear_prior`).
Samples of one robot change both in closed form (`finlab.fit.interaction.own_samples`), by the
equations of Bayesian linear regression (Bishop, 2006, section 3.3). What no weights explain is
noise of each message, in proportion to its vectors.

The formula runs in the core (finlab/core/src/linear_interaction.c), with its derivatives.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations_with_replacement, permutations
from pathlib import Path
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from msgspec import Meta

from finlab.arrays import Array
from finlab.bundle_files import file_stamp, read_named_file
from finlab.core import library
from finlab.core.calls import widest_lanes
from finlab.errors import CheckpointError, DataError
from finlab.interaction.interaction import (
    DENSITY,
    MIN_DISC_AREA,
    MIN_JET_SPEED,
    InteractionModel,
    JetGeometry,
    PointInteraction,
    jets_of,
)
from finlab.interaction.jets import JetInteraction, Jets
from finlab.interaction.messages import ROW_SIZES, Messages, unpack_rows
from finlab.whole_file import write_whole

FLOW_TERMS = ("propeller", "propeller_squared", "fin", "fin_squared", "side")
"""Terms of the flow: loss of thrust by the ratio of speeds and by its square, of actuators with an
open-water line and of others, and the force across."""
SMALL_RATIO = 1e-2
"""Ratio of speeds to which its size is rounded off [1]."""
CUBIC = {"pair": 6, "hull": 7}
"""The polynomials that are factors of messages are of degree 2 in all features, of degree 3 in so
many of the first ones: of pairs, those of the place of the receiver in the jet."""
DOUBLED = ("length", "width", "spread", "lag", "most", "side", "housing", "hull")
"""Constants of the formula of jets of which there is a term with twice the usual value."""
LINEAR_CONSTANTS = ("side", "housing", "hull")
"""Those of them in which the formula is linear."""
LEAST_WEIGHT = 1e-6
"""Least weight of a formula that others are merged into [1]."""
FORMULAS: tuple[Jets, ...] = (
    Jets(),
    *(replace(Jets(), **{name: 2.0 * getattr(Jets(), name)}) for name in DOUBLED),
)
"""The formulas of jets that are terms: with usual constants, and with each of these doubled."""
WEIGHTS_SUFFIX = ".safetensors"
"""End of the name of a file of weights."""
MAX_WEIGHTS_BYTES = 5_000_000
"""Largest file of weights [bytes]."""
EXPECTED_WEIGHTS_FILE = "weights of an interaction (.safetensors)"
"""What messages say was expected of a file that cannot be read."""
SHIPPED_PRIOR = Path(__file__).with_name("several_plants.safetensors")
"""Weights learned from random plants of several families."""
MAX_LATENTS = 512
"""Most latent numbers of a robot."""


def monomials(kind: str) -> list[tuple[int, ...]]:
    """Returns the monomials of the features of a kind of message, as indices of their factors: the
    constant, all features, all products of two, and those of three of the first ones."""
    features = range(ROW_SIZES[kind].features)
    result: list[tuple[int, ...]] = []
    for degree in range(3):
        result += combinations_with_replacement(features, degree)
    result += combinations_with_replacement(range(CUBIC[kind]), 3)
    return result


MONOMIALS = {kind: monomials(kind) for kind in ROW_SIZES}
"""Monomials by kind of message."""
FIRST_MESSAGE = len(FORMULAS) + len(FLOW_TERMS)
"""Index of the first weight of a message."""
WEIGHT_COUNT = FIRST_MESSAGE + sum(
    len(MONOMIALS[kind]) * size.vectors for kind, size in ROW_SIZES.items()
)
"""How many weights there are: of the formulas, of the flow, then by kind of message, by vector, by
monomial."""
USUAL_WEIGHTS = np.zeros(WEIGHT_COUNT)
"""Weights of which nothing is learned: of the usual formula of jets, with the loss of the
open-water line."""
USUAL_WEIGHTS[[0, len(FORMULAS)]] = 1.0


class Weights(NamedTuple):
    """What is known of the weights of a robot: before any sample of it, or after some."""

    mean: Array
    """m (`WEIGHT_COUNT`,) [1]."""
    factor: Array
    """L (`WEIGHT_COUNT`, r): deviations by each of the r latent numbers [1]."""
    noise: dict[str, float]
    """By kind of message, the standard deviation of what no weights explain, as a share of each of
    its vectors [1]."""
    spread: float
    """Factor of all standard deviations, by which intervals hold on robots held out [1]."""


@dataclass(frozen=True)
class Linear(InteractionModel):
    """Model of the interaction by weights. Checked on construction.

    Args:
        path: file of the weights, as `finlab train interaction` and `finlab fit interaction` write
            it; absolute once loaded from a layout file. None for the shipped one, learned from
            random plants of several families.
    """

    type: ClassVar[str] = "linear"

    path: Annotated[str, Meta(min_length=1, max_length=4096)] | None = None

    def of(self, geometry: JetGeometry) -> "LinearInteraction":
        """Returns the interaction of a robot's actuators. Raises CheckpointError: the file holds no
        such weights."""
        path = self.path or str(SHIPPED_PRIOR)
        return LinearInteraction(_cached_weights(path, file_stamp(path)), geometry)

    @property
    def reads(self) -> str | None:
        return self.path

    def reading(self, path: str) -> "Linear":
        return Linear(path)


class LinearInteraction(PointInteraction):
    """The model for one robot."""

    CORE_FUNCTION: ClassVar[str] = "fl_linear_interaction"

    def __init__(self, weights: Weights, geometry: JetGeometry) -> None:
        """Prepares one robot.

        Args:
            weights: what is known of them.
            geometry: points and jets of the n actuators, and the hull.
        """
        super().__init__(geometry)
        self.weights = weights
        self.terms = Terms(geometry)
        self._constants = self.constants_in_lanes(widest_lanes())

    @property
    def core_constants(self) -> Array:
        return self._constants

    def constants_in_lanes(self, lanes: int) -> Array:
        return self._constants_of(self.weights.mean, lanes)

    def at_rest(self, force: Array) -> Array:
        return self._in_core(force, None, False)[0]

    def offset(self, force: Array, inflow: Array | None = None) -> Array:
        return self._in_core(force, inflow, False)[1]

    def effect(self, force: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        return self._in_core(force, inflow, True)[1:]

    def deviation(self, force: Array, inflow: Array | None = None) -> Array:
        shape = force.shape[:-2]
        if inflow is not None:
            inflow = np.broadcast_to(inflow, force.shape).reshape(-1, *force.shape[-2:])
        rows = self.terms.rows(force.reshape(-1, *force.shape[-2:]), inflow)
        by_latent = rows.by_weight @ self.weights.factor
        variance = (by_latent**2).sum(axis=-1)
        for kind, share in self.weights.noise.items():
            variance += share**2 * np.diagonal(rows.covariance[kind], axis1=1, axis2=2)
        return np.asarray(self.weights.spread * np.sqrt(variance)).reshape(*shape, 6)

    def _in_core(
        self, force: Array, inflow: Array | None, with_slope: bool
    ) -> tuple[Array, Array, Array]:
        """What the core computes; as `compute_in_core`."""
        return self.call_core(
            library().fl_linear_interaction, self._constants, force, inflow, with_slope
        )

    def _constants_of(self, mean: Array, lanes: int) -> Array:
        """The numbers that finlab/core/src/linear_interaction.c reads, of weights and lanes."""
        messages = self.terms.messages.table
        of_formulas, formulas = _merged(mean[: len(FORMULAS)], self.geometry)
        of_flow = mean[len(FORMULAS) : FIRST_MESSAGE]
        flow = self.terms.flow
        propeller, propeller_squared, fin, fin_squared, side = of_flow
        discs = np.column_stack(
            [
                self.geometry.position,
                flow.area,
                flow.thrust_still,
                propeller * flow.advance + fin * flow.is_fin,
                propeller_squared * flow.advance + fin_squared * flow.is_fin,
                side * flow.momentum,
            ]
        )
        parts: list[Any] = [
            [len(self.lever), len(formulas), len(self.table), len(messages), DENSITY],
            discs.ravel(),
        ]
        for weight, formula in zip(of_formulas, formulas, strict=True):
            parts += [[weight], formula.table_in_lanes(lanes)]
        parts.append(messages)
        for kind, weights in by_vector(mean):
            parts.append(coefficients(kind, weights))
        return np.concatenate(parts, dtype=np.float64)


class TermRows(NamedTuple):
    """Terms of a robot at K forces."""

    by_weight: Array
    """Wrench (K, 6, `WEIGHT_COUNT`) of each term with a weight of 1 [N, N m]."""
    covariance: dict[str, Array]
    """By kind of message, the covariance (K, 6, 6) of the wrench where each message errs by all of
    its vectors, independently [N^2, ...]."""


class FlowTerms:
    """What a flow takes from the actuators of one robot, by weight."""

    def __init__(self, geometry: JetGeometry) -> None:
        """Takes points and jets of the n actuators."""
        disc = 0.25 * np.pi * geometry.diameter**2
        self.area = disc + MIN_DISC_AREA
        """Areas of the jets (n,) [m^2]."""
        self.thrust_still = 0.5 * DENSITY * self.area * MIN_JET_SPEED**2
        """Thrusts (n,) [N] that are left where there is no force."""
        self.advance = geometry.advance
        """Loss of thrust per ratio of speeds by the open-water lines (n,) [1]."""
        self.is_fin = (geometry.advance == 0.0) & (geometry.diameter > 0.0)
        """Actuators (n,) with a jet of which no loss is known."""
        self.momentum = DENSITY * disc
        """Mass (n,) of the water in a metre of a jet [kg/m]."""

    def forces(self, force: Array, inflow: Array, diameter: Array) -> Array:
        """Returns what the terms take.

        Args:
            force: (K, n, 3) [N], body frame.
            inflow: velocities of the points through the water (K, n, 3) [m/s].
            diameter: of the jets (n,) [m].

        Returns:
            Forces (K, n, 3, terms) [N], body frame.
        """
        jets = jets_of(force, diameter)
        along = (inflow * jets.ahead).sum(axis=-1)
        ratio = along / jets.speed
        squared = ratio * np.sqrt(ratio**2 + SMALL_RATIO**2)
        across = inflow - along[..., None] * jets.ahead
        shares = np.stack(
            [
                self.advance * ratio,
                self.advance * squared,
                self.is_fin * ratio,
                self.is_fin * squared,
            ],
            axis=-1,
        )
        lost = shares[..., None, :] * force[..., None]
        side = (self.momentum * jets.speed)[..., None] * across
        return -np.concatenate([lost, side[..., None]], axis=-1)


class Terms:
    """The terms of one robot, to which the model gives weights."""

    def __init__(self, geometry: JetGeometry) -> None:
        """Takes points and jets of the n actuators, and the hull."""
        self.formulas = [JetInteraction(jets, geometry) for jets in FORMULAS]
        self.messages = Messages(geometry)
        self.flow = FlowTerms(geometry)
        self._geometry = geometry
        lever = self.formulas[0].lever
        hull_count = self.messages.counts["hull"]
        self._levers = {"pair": lever[self.messages.receiver], "hull": lever[:hull_count]}

    def rows(self, force: Array, inflow: Array | None = None) -> TermRows:
        """Returns the terms.

        Args:
            force: (K, n, 3) [N], body frame.
            inflow: velocities of the points through the water (K, n, 3) [m/s]; None at rest.
        """
        # The terms of doubled constants are differences to the first one: with a weight of 1 for
        # that and 0 for all others the model is the usual formula.
        wrenches = [formula.offset(force) for formula in self.formulas]
        usual = wrenches[0]
        terms = [np.stack([usual, *(wrench - usual for wrench in wrenches[1:])], axis=-1)]
        taken = np.zeros((len(force), 6, len(FLOW_TERMS)))
        if inflow is not None:
            by_flow = self.flow.forces(force, inflow, self._geometry.diameter)
            taken = np.einsum("kibt,ibw->kwt", by_flow, self.formulas[0].lever)
        terms.append(taken)
        covariance = {}
        for kind, packed in self.messages.rows(force).items():
            features, vectors = unpack_rows(kind, packed)
            # Wrench of each vector (K, messages, vectors, 6).
            wrench = vectors @ self._levers[kind]
            powers = _values(kind, features)
            # Sum over messages of monomial times wrench, for all vectors: (K, vectors * 6, terms).
            flat = wrench.reshape(*wrench.shape[:2], -1)
            products = flat.swapaxes(1, 2) @ powers
            by_axis = products.reshape(len(force), wrench.shape[2], 6, -1).swapaxes(1, 2)
            terms.append(by_axis.reshape(len(force), 6, -1))
            every = wrench.reshape(len(force), -1, 6)
            covariance[kind] = every.swapaxes(1, 2) @ every
        return TermRows(np.concatenate(terms, axis=-1), covariance)


def _values(kind: str, features: Array) -> Array:
    """Values (..., t) of the monomials of features (..., f)."""
    index = {monomial: k for k, monomial in enumerate(MONOMIALS[kind])}
    values = np.empty((*features.shape[:-1], len(index)))
    values[..., 0] = 1.0
    for monomial, k in index.items():
        if monomial:
            values[..., k] = values[..., index[monomial[:-1]]] * features[..., monomial[-1]]
    return values


def _merged(weights: Array, geometry: JetGeometry) -> tuple[Array, list[JetInteraction]]:
    """Formulas whose sum is that of `FORMULAS`, of which all but the first are differences to the
    first one: fewer, since a formula is linear in some of its constants.

    Args:
        weights: of `FORMULAS`.
        geometry: of the robot.

    Returns:
        Weights of the formulas, and the formulas.
    """
    is_linear = np.array([name in LINEAR_CONSTANTS for name in (None, *DOUBLED)])
    others = [k for k in range(1, len(weights)) if not is_linear[k]]
    first = float(weights[0] - weights[others].sum())
    if abs(first) < LEAST_WEIGHT:
        first = LEAST_WEIGHT  # the others are so large that this is nothing beside them
    changed = {}
    for name in LINEAR_CONSTANTS:
        # The formulas not doubled in it have this constant too, once each.
        weight = float(weights[1 + DOUBLED.index(name)])
        changed[name] = getattr(FORMULAS[0], name) * (1.0 + weight / first)
    base = JetInteraction(FORMULAS[0], geometry, changed)
    merged = [base, *(JetInteraction(FORMULAS[k], geometry) for k in others)]
    return np.array([first, *weights[others]]), merged


def by_vector(weights: Array) -> Iterator[tuple[str, Array]]:
    """Yields each kind of message with its weights (vectors, monomials)."""
    start = FIRST_MESSAGE
    for kind, size in ROW_SIZES.items():
        count = size.vectors * len(MONOMIALS[kind])
        yield kind, weights[start : start + count].reshape(size.vectors, -1)
        start += count


def coefficients(kind: str, weights: Array) -> Array:
    """Returns the coefficients of the polynomials of a kind of message, as the core reads them.

    Args:
        kind: of the messages.
        weights: of the vectors' monomials (k, t).

    Returns:
        The constants (k,), and for each degree d from 1 to 3, by the first d - 1 factors of a
        monomial in order, an array (k, f) of the f features that have monomials of this degree:
        with x their product, x times it adds up to the polynomials' gradients over d. Flat.
    """
    vectors, features = ROW_SIZES[kind].vectors, ROW_SIZES[kind].features
    result = [weights[:, 0]]
    index = {monomial: k for k, monomial in enumerate(MONOMIALS[kind])}
    for degree, count in ((1, features), (2, features), (3, CUBIC[kind])):
        for first in combinations_with_replacement(range(count), degree - 1):
            array = np.zeros((vectors, count))
            for last in range(count):
                monomial = tuple(sorted((*first, last)))
                # The share of the monomial's derivative that falls to this order of its factors.
                share = len(set(permutations(first))) / len(set(permutations(monomial)))
                array[:, last] = share * weights[:, index[monomial]]
            result.append(array.ravel())
    return np.concatenate(result)


@lru_cache(maxsize=16)
def _cached_weights(path: str, stamp: object) -> Weights:
    """As `read_weights`; once for all robots that name the file, until its stamp changes."""
    return read_weights(path)


def read_weights(path: str) -> Weights:
    """Returns the weights in a file.

    Raises:
        CheckpointError: the file is missing, damaged or of another kind.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load

    content = read_named_file(path, MAX_WEIGHTS_BYTES, EXPECTED_WEIGHTS_FILE, CheckpointError)
    try:
        arrays = {name: array.astype(np.float64) for name, array in load(content).items()}
        weights = _weights_of(arrays)
    except (SafetensorError, KeyError, ValueError) as error:
        reason = str(error).splitlines()[0][:100]
        raise CheckpointError(
            f"{path}: no weights of an interaction ({reason}); see `finlab train interaction`"
        ) from None
    return weights


def _weights_of(arrays: Mapping[str, Array]) -> Weights:
    """The weights of a file's arrays. Raises KeyError: one is missing; ValueError: one has another
    shape, or holds what is no finite number."""
    factor = arrays["factor"]
    if factor.ndim != 2 or factor.shape[1] > MAX_LATENTS:
        raise ValueError(f"factor: expected at most {MAX_LATENTS} columns, got {factor.shape}")
    shapes = {
        "mean": (WEIGHT_COUNT,),
        "unit": (WEIGHT_COUNT,),
        "factor": (WEIGHT_COUNT, factor.shape[1]),
        "noise": (len(ROW_SIZES),),
        "spread": (1,),
    }
    for name, shape in shapes.items():
        if arrays[name].shape != shape or not np.isfinite(arrays[name]).all():
            raise ValueError(f"{name}: expected finite numbers of shape {shape}")
    noise = dict(zip(ROW_SIZES, arrays["noise"].tolist(), strict=True))
    scaled = arrays["unit"][:, None] * factor
    return Weights(arrays["mean"], scaled, noise, float(arrays["spread"][0]))


def write_weights(path: Path, weights: Weights) -> None:
    """Writes the file of weights. Raises DataError: it cannot be written."""
    from safetensors.numpy import save

    # Deviations of weights differ by orders of magnitude: rows over their largest number fit into
    # half precision.
    unit = np.maximum(np.abs(weights.factor).max(axis=1, initial=0.0), 1e-30)
    arrays = {
        "mean": weights.mean.astype(np.float32),
        "factor": (weights.factor / unit[:, None]).astype(np.float16),
        "unit": unit.astype(np.float32),
        "noise": np.array([weights.noise[kind] for kind in ROW_SIZES], np.float32),
        "spread": np.array([weights.spread], np.float32),
    }
    write_whole(path, save(arrays), DataError)
