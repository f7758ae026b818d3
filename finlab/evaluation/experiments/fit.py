"""How near fits to a few noisy samples come to the fins that were measured, and what their errors cost.

A robot of such fins is asked for wrenches that it can deliver, and the true fins score the answers.
"""

import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.evaluation.experiment import Experiment
from finlab.evaluation.method_specs import MethodSpec, load_method_spec
from finlab.evaluation.progress import progress
from finlab.evaluation.report.document import Column, Row
from finlab.evaluation.splits import Case, make_split
from finlab.fit.fin_file import write_fin
from finlab.fit.fin_fit import BAND, fit_fin
from finlab.fit.measurements import MIN_SAMPLES, Measurements
from finlab.layout import FinModelSpec, Layout
from finlab.physics import Plant, make_law

DOMAIN = 0xF17
"""Leads the seed of every draw here."""
HELD_OUT = 2000
"""Commands at which a fit is compared with the true fin."""


def run(
    fins: int = 40,
    samples: int = 300,
    noise: float = 0.05,
    targets: int = 20,
    method: str = "dual",
    seed: int = 0,
) -> list[Row]:
    """One row over all fins.

    Args:
        fins: of split fins, each of a robot of its own.
        samples: measurements of each fin, at random commands.
        noise: standard deviation of each component of a force, as a share of the force.
        targets: wrenches asked of a robot with each of the fins.
        method: who answers.
        seed: of all draws.
    """
    if samples < MIN_SAMPLES:
        raise DataError(f"samples: expected at least {MIN_SAMPLES}, got {samples}")
    if not 0.0 <= noise < 1.0:
        raise DataError(f"noise: expected a share from 0 to 1, got {noise:g}")
    spec = load_method_spec(method)
    found = [
        _fitted(spec, case, samples, noise, np.random.default_rng([DOMAIN, seed, k]))
        for k, case in enumerate(progress(list(make_split("fins", fins, targets, seed)), "fin"))
    ]
    each = {key: np.array([row[key] for row in found]) for key in found[0]}
    return [
        {
            "n": len(found),
            "error_median": float(np.median(each["error"])),
            "error_worst": float(each["error"].max()),
            "covered": float(each["covered"].mean()),
            "covered_least": float(each["covered"].min()),
            "outliers": int(each["outliers"].sum()),
            "trusted": float(each["trusted"].mean()),
            "err_norm": float(each["missed"].mean()),
            "fit_s": float(each["fit_s"].max()),
        }
    ]


def _fitted(method: MethodSpec, case: Case, samples: int, noise: float, rng: np.random.Generator) -> Row:
    """Figures of one fin, fitted and tried."""
    fin = case.layout.fins[0]  # all fins of the robot are alike
    law, plant = make_law(fin.model), Plant(Layout("one", (fin,)))
    command, held_out = (plant.sample(rng, (n,))[:, 0] for n in (samples, HELD_OUT))
    force = law.force(command)
    size = np.linalg.norm(force, axis=-1, keepdims=True)
    noisy: Array = force + noise * size * rng.standard_normal(force.shape)
    places = tuple(f"sample {i}" for i in range(samples))
    start = time.process_time()
    fit = fit_fin(Measurements(command, noisy, None, None, places, ()))
    seconds = time.process_time() - start
    (predicted, deviation), truth = fit.predict(held_out), law.force(held_out)
    error = np.linalg.norm(predicted - truth, axis=-1) / np.linalg.norm(truth, axis=-1).max()
    covered = np.abs(predicted - truth)[:, 1:] <= BAND * deviation[:, 1:]
    with tempfile.TemporaryDirectory() as folder:
        write_fin(fit, Path(folder) / "fin.csv")
        model = FinModelSpec("table", (("path", str(Path(folder) / "fin.csv")),))
        robot = replace(case.layout, actuators=tuple(replace(fin, model=model) for fin in case.layout.fins))
        answer = method.on(robot).allocate_batch(case.targets)
    missed = Plant(case.layout).wrench(answer.command) - case.targets
    assert case.sigma is not None, "robots of split fins have a sigma of their own"
    return {
        "error": float(np.sqrt(np.mean(error**2))),
        "covered": float(covered.mean()),
        "outliers": len(fit.outliers),
        "trusted": not fit.doubts,
        "missed": float(np.linalg.norm(missed / case.sigma, axis=-1).mean()),
        "fit_s": seconds,
    }


experiment = Experiment(
    name="fit",
    question="How near do fits of noisy samples come to the true fins, and what do answers miss by it?",
    columns=(
        Column("n", "number", "count"),
        Column("error_median", "force error, median fin", "share"),
        Column("error_worst", "worst fin", "share"),
        Column("covered", "in the 95 % band", "share"),
        Column("covered_least", "least of a fin", "share"),
        Column("err_norm", "err_norm, fitted", "error"),
        Column("outliers", "samples left out", "count"),
        Column("trusted", "trusted", "share"),
        Column("fit_s", "longest fit", "three", unit="s"),
    ),
    run=run,
    note="Force errors are root mean squares over commands that the fit has not seen, over the fin's largest "
    "force; the band is that of the forces across the shaft. `err_norm`: a robot of such fins is asked for "
    "wrenches that it can deliver, and the true fins score the answers. No sample was wrong, so none should "
    "be left out.",
    quick={"fins": 4, "targets": 5},
    full={"fins": 20},
)
