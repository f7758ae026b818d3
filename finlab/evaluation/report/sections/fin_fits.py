"""How well fins are fitted to measurements, by kind of noise and of fin."""

from collections.abc import Sequence

from finlab.evaluation.report.document import Block, Column, Row, Table

ERRORS = (
    Column("noise_of", "noise is a share of"),
    Column("fins", "fins", "code"),
    Column("n", "", "count"),
    Column("error_median", "force error, median fin", "share"),
    Column("error_worst", "worst fin", "share"),
    Column("error_largest", "at the worst command", "share"),
    Column("covered", "in the 95 % band", "share"),
    Column("covered_least", "least of a fin", "share"),
    Column("covered_most", "most", "share"),
)
COSTS = (
    Column("noise_of", "noise is a share of"),
    Column("fins", "fins", "code"),
    Column("err_norm", "err_norm, fitted", "error"),
    Column("err_norm_floor", "noise floor", "error"),
    Column("ratio", "ratio", "three"),
    Column("outliers", "samples left out", "count"),
    Column("trusted", "trusted", "share"),
    Column("fit_s", "longest fit [s]", "three"),
    Column("page_s", "longest page [s]", "three"),
)


def fin_fit_blocks(rows: Sequence[Row], samples: int, noise: float) -> list[Block]:
    """The whole section."""
    return [
        "## Fitted fins",
        (
            f"Random fins, each fitted to {samples} samples at random commands with noise of {noise:.1%}, "
            "of each force or of the largest one. Force errors are root mean squares over commands that the "
            "fit has not seen, over the fin's largest force; the band is that of the forces across the shaft."
        ),
        Table(ERRORS, rows),
        (
            "A robot of such fins is asked for wrenches that it can reach; the true fins score the answers. "
            "The noise floor is what the same method misses with a full grid of 864 forces, measured with "
            "the same noise and not fitted. No sample was wrong, so none should be left out. Times are the "
            "processor's."
        ),
        Table(COSTS, rows),
    ]
