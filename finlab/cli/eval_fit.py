"""`finlab eval fit`: fitted fins against the fins that were measured."""

from typing import Annotated

from tyro.conf import arg

from finlab.cli.eval_arguments import Count, Name, Output
from finlab.cli.inputs import check_positive
from finlab.errors import DataError

OUTPUT = Output()


def fit(
    fins: Count = 40,
    samples: Count = 300,
    noise: Annotated[float, arg(metavar="SHARE")] = 0.05,
    targets: Count = 20,
    method: Name = "search",
    seed: Count = 0,
    output: Annotated[Output, arg(name="")] = OUTPUT,
) -> None:
    """Fit random fins to noisy samples: error, band, what answers miss by it, and time.

    Args:
        fins: random fins, every second one a soft fin, the others as in split fins.
        samples: measurements of each fin.
        noise: standard deviation of each component of a force, as a share of the force, and of the largest.
        targets: wrenches asked of a robot with each of the fins.
        method: who answers.
        seed: draws everything.
    """
    from finlab.evaluation.experiments.fin_fits import fin_fit_rows
    from finlab.evaluation.method_specs import load_method_spec
    from finlab.evaluation.report.sections.fin_fits import fin_fit_blocks
    from finlab.fit.measurements import MIN_SAMPLES

    check_positive(fins=fins, targets=targets)
    if samples < MIN_SAMPLES:
        raise DataError(f"samples: expected at least {MIN_SAMPLES}, got {samples}")
    if not 0.0 <= noise < 1.0:
        raise DataError(f"noise: expected a share from 0 to 1, got {noise:g}")
    drawn = {"fins": fins, "samples": samples, "targets": targets, "seed": seed}
    rows = fin_fit_rows(load_method_spec(method), noise=noise, **drawn)
    output.show(*fin_fit_blocks(rows, samples, noise), rows=rows)
