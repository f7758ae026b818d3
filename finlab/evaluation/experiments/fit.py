"""How near fits to a few noisy samples come to the fins that were measured, and what their errors cost.

An answer for a fitted fin misses by the errors of the fit. It is compared with a noise floor: the same
targets, the same allocator, and a *full grid* of 864 forces of the same fin, measured with the same noise and
not fitted. The true fin scores both.
"""

import tempfile
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

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
from finlab.fit.fin_fit import BAND, fit_fin
from finlab.fit.measurements import MIN_SAMPLES, Measurements
from finlab.layout import FinModelSpec, Layout
from finlab.layout.random_fins import random_fin_model
from finlab.physics import Plant, make_law

DOMAIN = 0xF17
"""Leads the seed of every draw here."""
HELD_OUT = 2000
"""Commands at which a fit is compared with the true fin."""
KINDS = ("fins", "soft")
"""Fins of split `fins`, and soft fins, in turn."""
NOISES = ("each force", "the largest")
"""What noise is a share of."""


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
    for of in NOISES:
        found = [
            _fitted(allocator, case, samples, noise, of, np.random.default_rng([DOMAIN, seed, k]))
            for k, case in enumerate(progress(cases, "fin", f"noise of {of}"))
        ]
        for kind, chosen in (
            *((kind, found[i :: len(KINDS)]) for i, kind in enumerate(KINDS)),
            ("all", found),
        ):
            rows += [{"noise_of": of, "fins": kind, **_figures(chosen)}] if chosen else []
    return rows


def measured(rng: np.random.Generator, force: Array, share: float, of: str) -> Array:
    """Forces (..., 3) with noise of a standard deviation that is a share of each one's size, or of the
    largest."""
    size = np.linalg.norm(force, axis=-1, keepdims=True)
    deviation = share * (size.max() if of == "the largest" else size)
    return np.asarray(force + deviation * rng.standard_normal(force.shape))


def _case(case: Case, k: int, seed: int) -> Case:
    """A robot of split `fins` as it is, or every second one with a random soft fin."""
    if KINDS[k % len(KINDS)] == "fins":
        return case
    rng = np.random.default_rng([DOMAIN, seed, k, 1])
    layout = _with_model(case.layout, random_fin_model(rng, "soft"))
    plant = Plant(layout)
    targets = plant.wrench(plant.sample(rng, (len(case.targets),)))
    return Case(layout, targets, (), own_sigma(plant, rng))


def _fitted(
    allocator: Allocator, case: Case, samples: int, noise: float, of: str, rng: np.random.Generator
) -> Row:
    """Figures of one fin, fitted and tried."""
    fin = case.layout.fins[0]  # all fins of the robot are alike
    law, plant = make_law(fin.model), Plant(Layout("one", (fin,)))
    command, held_out = (plant.sample(rng, (n,))[:, 0] for n in (samples, HELD_OUT))
    places = tuple(f"sample {i}" for i in range(samples))
    noisy = measured(rng, law.force(command), noise, of)
    start = time.process_time()
    fit = fit_fin(Measurements(command, noisy, None, None, places, ()))
    seconds = time.process_time() - start
    (force, deviation), truth = fit.predict(held_out), law.force(held_out)
    error = np.linalg.norm(force - truth, axis=-1) / np.linalg.norm(truth, axis=-1).max()
    covered = np.abs(force - truth)[:, 1:] <= BAND * deviation[:, 1:]
    with tempfile.TemporaryDirectory() as folder:
        write_fin(fit, Path(folder) / "fin.csv")
        fitted = FinModelSpec("table", (("path", str(Path(folder) / "fin.csv")),))
        missed = _missed(allocator, case, fitted)
    grid = noisy_table(rng, fin, f"fit-{rng.integers(1 << 62):x}", partial(measured, share=noise, of=of))
    return {
        "error": float(np.sqrt(np.mean(error**2))),
        "covered": float(covered.mean()),
        "outliers": len(fit.outliers),
        "trusted": not fit.doubts,
        "missed": missed,
        "floor": _missed(allocator, case, grid.model),
        "fit_s": seconds,
    }


def _missed(allocator: Allocator, case: Case, model: FinModelSpec) -> float:
    """Mean normalized error of answers for a robot with fins of a model, scored by its own."""
    answer = allocator.allocate_batch(_with_model(case.layout, model), case.targets)
    delivered = Plant(case.layout).wrench(answer.command)
    assert case.sigma is not None, "robots of split fins have a sigma of their own"
    return float(np.linalg.norm((delivered - case.targets) / case.sigma, axis=-1).mean())


def _with_model(layout: Layout, model: FinModelSpec) -> Layout:
    return replace(layout, fins=tuple(replace(fin, model=model) for fin in layout.fins))


def _figures(found: list[Row]) -> Row:
    each = {key: np.array([row[key] for row in found]) for key in found[0]}
    return {
        "n": len(found),
        "error_median": float(np.median(each["error"])),
        "error_worst": float(each["error"].max()),
        "covered": float(each["covered"].mean()),
        "covered_least": float(each["covered"].min()),
        "outliers": int(each["outliers"].sum()),
        "trusted": float(each["trusted"].mean()),
        "err_norm": float(each["missed"].mean()),
        "err_norm_floor": float(each["floor"].mean()),
        "fit_s": float(each["fit_s"].max()),
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
