"""How near fits to a few noisy samples come to the fins that were measured, and what their errors cost.

An answer for a fitted fin misses by what the fit got wrong. It is held against a noise floor: the same
targets, the same allocator, and a *full grid* of 864 forces of the same fin, measured with the same noise and
taken as it stands. That is what a builder could hand over without a fit, and the best that an allocation can
do on measurements of this quality; the true fin scores both.
"""

import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.arrays import Array
from finlab.errors import DataError
from finlab.evaluation.experiment import Experiment
from finlab.evaluation.method_specs import load_method_spec
from finlab.evaluation.noisy_tables import noisy_table
from finlab.evaluation.progress import progress
from finlab.evaluation.report.document import Column, Row
from finlab.evaluation.splits import Case, make_split, own_sigma
from finlab.fit.fin_file import write_fin
from finlab.fit.fin_fit import BAND, FinFit, fit_fin
from finlab.fit.measurements import MIN_SAMPLES, Measurements
from finlab.layout import FinModelSpec, Layout
from finlab.layout.random_fins import random_fin_model
from finlab.physics import Plant, make_law

DOMAIN = 0xF17
"""Leads the seed of every draw here."""
HELD_OUT = 2000
"""Commands at which a fit is compared with the true fin."""
KINDS = ("fins", "soft")
"""Fins of split `fins`, and soft fins."""

Noise = Callable[[np.random.Generator, Array], Array]
"""From a generator and true forces (..., 3) [N]: measured ones."""


def of_each(share: float) -> Noise:
    """Noise whose standard deviation is a share of each force's size."""

    def measured(rng: np.random.Generator, force: Array) -> Array:
        size = np.linalg.norm(force, axis=-1, keepdims=True)
        return np.asarray(force + share * size * rng.standard_normal(force.shape))

    return measured


def of_largest(share: float) -> Noise:
    """Noise whose standard deviation is a share of the largest force."""

    def measured(rng: np.random.Generator, force: Array) -> Array:
        size = np.linalg.norm(force, axis=-1).max()
        return np.asarray(force + share * size * rng.standard_normal(force.shape))

    return measured


NOISES: dict[str, Callable[[float], Noise]] = {"each force": of_each, "the largest": of_largest}
"""What the noise is a share of."""


class Fitted(NamedTuple):
    """One fin, fitted and tried."""

    error: Array
    """Error of the force over the largest one at held-out commands (n,)."""
    covered: float
    """Share of the forces across the shaft that lie in their 95 % band."""
    outliers: int
    """Samples that were left out; none of them was wrong."""
    trusted: bool
    """Whether the fit says that it may be trusted."""
    missed: Array
    """Normalized error of answers for the fitted fin, scored by the true one (t,)."""
    floor: Array
    """The same for a full grid with the same noise (t,)."""
    fit_s: float
    """The processor's time of the fit [s]."""


def run(
    fins: int = 40,
    samples: int = 300,
    noise: float = 0.05,
    targets: int = 20,
    method: str = "search",
    seed: int = 0,
) -> list[Row]:
    """One row for each kind of noise and of fins, and one over all fins.

    Args:
        fins: random fins, every second one a soft fin, the others as in split fins.
        samples: measurements of each fin, at random commands.
        noise: standard deviation of each component of a force, as a share of the force, and of the largest.
        targets: wrenches asked of a robot with each of the fins.
        method: who answers.
        seed: of all draws.
    """
    if samples < MIN_SAMPLES:
        raise DataError(f"samples: expected at least {MIN_SAMPLES}, got {samples}")
    if not 0.0 <= noise < 1.0:
        raise DataError(f"noise: expected a share from 0 to 1, got {noise:g}")
    allocator = load_method_spec(method)
    cases = [_case(case, k, seed) for k, case in enumerate(make_split("fins", fins, targets, seed))]
    rows: list[Row] = []
    for of, make in NOISES.items():
        found = [
            _fitted(allocator, case, samples, make(noise), np.random.default_rng([DOMAIN, seed, k]))
            for k, case in enumerate(progress(cases, "fin", f"noise of {of}"))
        ]
        for i, kind in enumerate(KINDS):
            if found[i :: len(KINDS)]:
                rows.append({"noise_of": of, "fins": kind, **_figures(found[i :: len(KINDS)])})
        rows.append({"noise_of": of, "fins": "all", **_figures(found)})
    return rows


def _case(case: Case, k: int, seed: int) -> Case:
    """A robot of split `fins` as it is, or every second one with a random soft fin."""
    if KINDS[k % len(KINDS)] == "fins":
        return case
    rng = np.random.default_rng([DOMAIN, seed, k, 1])
    layout = _with_model(case.layout, random_fin_model(rng, "soft"))
    plant = Plant(layout)
    targets = plant.wrench(plant.sample(rng, (len(case.targets),)))
    return Case(layout, targets, (), own_sigma(plant, rng))


def _fitted(allocator: Allocator, case: Case, samples: int, noise: Noise, rng: np.random.Generator) -> Fitted:
    fin = case.layout.fins[0]  # all fins of the robot are alike
    law, plant = make_law(fin.model), Plant(Layout("one", (fin,)))
    command, held_out = (plant.sample(rng, (n,))[:, 0] for n in (samples, HELD_OUT))
    places = tuple(f"sample {i}" for i in range(samples))
    measurements = Measurements(command, noise(rng, law.force(command)), None, None, places, ())
    start = time.process_time()
    fit = fit_fin(measurements)
    fit_s = time.process_time() - start
    error, covered = _against(fit, held_out, law.force(held_out))
    with tempfile.TemporaryDirectory() as folder:
        write_fin(fit, Path(folder) / "fin.csv")
        fitted = FinModelSpec("table", (("path", str(Path(folder) / "fin.csv")),))
        missed = _missed(allocator, case, fitted)
        grid = noisy_table(rng, fin, f"fit-{rng.integers(1 << 62):x}", noise)
        floor = _missed(allocator, case, grid.model)
    return Fitted(error, covered, len(fit.outliers), not fit.doubts, missed, floor, fit_s)


def _against(fit: FinFit, command: Array, truth: Array) -> tuple[Array, float]:
    """Error over the largest force at commands (n,), and the share of true forces within the band."""
    force, deviation = fit.predict(command)
    error = np.linalg.norm(force - truth, axis=-1) / np.linalg.norm(truth, axis=-1).max()
    covered = np.abs(force - truth)[:, 1:] <= BAND * deviation[:, 1:]
    return error, float(covered.mean())


def _missed(allocator: Allocator, case: Case, model: FinModelSpec) -> Array:
    """Normalized errors (t,) of answers for a robot with fins of a model, scored by its own."""
    answer = allocator.allocate_batch(_with_model(case.layout, model), case.targets)
    delivered = Plant(case.layout).wrench(answer.command)
    assert case.sigma is not None, "robots of split fins have a yardstick of their own"
    return np.asarray(np.linalg.norm((delivered - case.targets) / case.sigma, axis=-1))


def _with_model(layout: Layout, model: FinModelSpec) -> Layout:
    return replace(layout, fins=tuple(replace(fin, model=model) for fin in layout.fins))


def _figures(found: list[Fitted]) -> Row:
    error = [float(np.sqrt(np.mean(fit.error**2))) for fit in found]
    missed, floor = (np.mean([np.mean(getattr(fit, name)) for fit in found]) for name in ("missed", "floor"))
    covered = [fit.covered for fit in found]
    return {
        "n": len(found),
        "error_median": float(np.median(error)),
        "error_worst": max(error),
        "error_largest": float(np.median([fit.error.max() for fit in found])),
        "covered": float(np.mean(covered)),
        "covered_least": min(covered),
        "covered_most": max(covered),
        "outliers": sum(fit.outliers for fit in found),
        "trusted": float(np.mean([fit.trusted for fit in found])),
        "err_norm": float(missed),
        "err_norm_floor": float(floor),
        "ratio": float(missed / floor),
        "fit_s": max(fit.fit_s for fit in found),
    }


experiment = Experiment(
    name="fit",
    question="How near do fits of noisy samples come to the true fins, and what do answers miss by it?",
    columns=(
        Column("noise_of", "noise is a share of"),
        Column("fins", "fins", "code"),
        Column("n", "number", "count"),
        Column("error_median", "force error, median fin", "share"),
        Column("error_worst", "worst fin", "share"),
        Column("covered", "in the 95 % band", "share"),
        Column("covered_least", "least of a fin", "share"),
        Column("err_norm", "err_norm, fitted", "error"),
        Column("err_norm_floor", "noise floor", "error"),
        Column("outliers", "samples left out", "count"),
        Column("trusted", "trusted", "share"),
        Column("fit_s", "longest fit", "three", unit="s"),
    ),
    run=run,
    note="Force errors are root mean squares over commands that the fit has not seen, over the fin's largest "
    "force; the band is that of the forces across the shaft. `err_norm`: a robot of such fins is asked for "
    "wrenches that it can deliver, and the true fins score the answers; the noise floor is the same with a "
    "full grid of 864 forces with the same noise, not fitted. No sample was wrong, so none should be left "
    "out.",
    quick={"fins": 4, "targets": 5},
    full={"fins": 20},
)
