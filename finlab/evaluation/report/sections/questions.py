"""What else is asked of the default method: all ways, wrenches out of reach, tick after tick."""

from collections.abc import Sequence

from finlab.evaluation.experiments.mode_coverage import CHEAP
from finlab.evaluation.experiments.noisy_sequences import NOISE
from finlab.evaluation.experiments.steadiness import GOAL, RATE
from finlab.evaluation.report.document import Block, Column, Row, Table, method_row


def mode_blocks(
    rows: Sequence[Row], starts: int, *, method: str = "search", objective: str = "effort", split: str = "id"
) -> list[Block]:
    """Distinct ways against a ground truth that knows no search, from so many random starts per target."""
    columns = (
        Column("fins", "fins", "count"),
        Column("n", "targets", "count"),
        Column("truth", "ways of the starts", "three"),
        Column("modes", "ways by explore()", "three"),
        Column("coverage", "of the starts' ways, found by explore()", "share"),
        Column("truth_coverage", "of explore()'s ways, found by the starts", "share"),
        Column("best_cost", f"least {objective} over the starts'", "ratio"),
        Column("distance", "energy distance", "error"),
    )
    return [
        "## Distinct ways",
        (
            "With four fins and more, a wrench can often be delivered in several ways. Here method "
            f"`{method}` keeps {objective} least on split `{split}`: what "
            f"`explore` finds, beside what {starts} random starts of IPOPT per target converge to; "
            f"ways of up to {CHEAP:g} times the least {objective}, exact by the plant, whose fins' laws both "
            "were given."
        ),
        Table(columns, rows),
    ]


def unreachable_blocks(rows: Sequence[Row]) -> list[Block]:
    """What is delivered of a wrench out of reach."""
    columns = (
        Column("limits", "limits"),
        Column("policy", "policy", "code"),
        Column("n", "targets", "count"),
        Column("excess_median", "excess, median", "error"),
        Column("excess_max", "excess, largest", "error"),
        Column("beside_max", "beside, largest", "error"),
        Column("p50_ms", "ms per call", "three"),
        Column("max_ms", "slowest", "three"),
    )
    return [
        "## Out of reach",
        (
            "Method `search` under each policy, on random robots of 2 to 8 fins of the law `drag`, beside "
            "the best that IPOPT finds in the fins' forces; scored by the plant. Excess: for "
            "`closest`, and for the first group of `priority`, normalized error beyond the least possible; "
            "for `direction`, share of the target lacking to the largest possible. Beside: normalized wrench "
            "beside that share."
        ),
        Table(columns, rows),
    ]


def beyond_blocks(rows: Sequence[Row]) -> list[Block]:
    """What methods miss on the boundary of what robots can do, and beyond."""
    columns = (
        Column("factor", "asked over largest", "three"),
        Column("method", "method"),
        Column("n", "targets", "count"),
        Column("least_mean", "least possible error, mean", "error"),
        Column("excess_mean", "missed beyond it, mean", "error", "excess_mean_interval"),
        Column("excess_median", "median", "error"),
        Column("excess_max", "largest", "error"),
    )
    return [
        "## On the boundary and beyond",
        (
            "Every method is asked for the largest wrench of a random direction, as IPOPT finds it in the "
            "fins' forces, and for 1.2, 2 and 3 times as much, on layouts of split `id`. The least possible "
            "error is IPOPT's, too, and exact to about 1e-5, so what is missed beyond it may be as much "
            "below zero. Errors are in standard deviations of the wrenches of random layouts of 2 to 5 of "
            "U-CAT's fins, by the plant. `search` takes a target as delivered when its error is at most "
            "0.01, and looks for the nearest wrench within reach only beyond that."
        ),
        Table(columns, [method_row(row) for row in rows]),
    ]


def sequence_blocks(rows: Sequence[Row], noise: float = NOISE) -> list[Block]:
    """What commands change by along noisy sequences."""
    changes = (
        Column(f"{what}_{figure}", f"{title}, {figure}", "error")
        for figure in ("mean", "p99")
        for what, title in (("amplitude", "A [rad]"), ("frequency", "f [Hz]"), ("turn", "phi [rad]"))
    )
    columns = (
        Column("layout", "layout", "code"),
        Column("method", "method"),
        Column("ticks", "ticks", "count"),
        *changes,
        Column("err_norm_mean", "mean error", "error"),
        Column("late_mean", "late", "three"),
        Column("power_mean", "power [W]", "three"),
    )
    return [
        "### Sequences with noise",
        (
            f"Smooth random paths of wrenches at {RATE:g} Hz with white noise on every axis, "
            f"{100 * noise:g} % of the path's root mean square, as the noise of sensors makes a controller "
            "ask for. Every method is given its previous command; only `search` and `mdn` make use of it. "
            "Changes of amplitude, frequency and zero direction from tick to tick, over all fins: mean and "
            "99th percentile. `search` and `mdn` change commands no faster than the servos' rates, and miss "
            "part of the wrench for it (mean error). Late: mean error of what fins give that follow their "
            "commands with the lags of their servos."
        ),
        Table(columns, [method_row(row) for row in rows]),
    ]


def steadiness_blocks(rows: Sequence[Row], objective: str = "power") -> list[Block]:
    """How far fins turn from tick to tick."""
    columns = (
        Column("layout", "layout", "code"),
        Column("fins", "fins", "count"),
        Column("paths", "paths", "count"),
        Column("turn_free", "turn without [rad]", "three"),
        Column("turn_steady", "turn with [rad]", "three"),
        Column("turn_ratio", "worst ratio", "ratio"),
        Column("steady", f"paths within {GOAL:g}", "count"),
        Column("forced", "forced [rad]", "three"),
        Column("frequency_steady", "frequency [Hz]", "three"),
        Column("amplitude_steady", "amplitude [rad]", "three"),
        Column(f"{objective}_ratio", f"{objective} with / without", "ratio"),
        Column("missed", "ticks missed", "share"),
        Column("err_norm_max", "largest error", "error"),
        Column("late_free", "late without", "three"),
        Column("late_steady", "late with", "three"),
        Column("ms_free", "ms without", "three"),
        Column("ms_steady", "ms with", "three"),
    )
    return [
        "## From tick to tick",
        (
            f"Method `search` follows smooth random paths of wrenches at {RATE:g} Hz, with and without its "
            f"previous command as an argument; it keeps {objective} least, by each layout's own fins, and "
            "the plant scores every tick. Turn, frequency, amplitude: the largest change of any fin's "
            "command in one tick. Forced: what any answer must turn, where the fins' forces are unique. "
            "Missed: ticks with an error above 0.01, since commands change no faster than the servos' rates "
            "or a limit is in the way. Late: mean error of what fins give that follow their commands with "
            "the lags of their servos."
        ),
        Table(columns, rows),
    ]
