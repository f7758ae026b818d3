"""The paper's conclusions, each as a printed figure, ours from the rows of a report, and a verdict.

Each is a quotient of two figures of one table, so that scales and targets that differ from the
paper's cancel as far as they can.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from finlab.research.evaluation.document import Row, format_digits, format_error
from finlab.research.evaluation.experiment import paper_figures
from finlab.research.evaluation.scoring import paired_interval
from finlab.research.evaluation.verdict import NEAR, Comparison

Rows = Mapping[str, Sequence[Row]]
"""Rows of a report, by the name of the experiment."""


def claims(rows: Rows) -> list[Comparison]:
    """Returns the paper's conclusions, of those experiments whose rows are there.

    Args:
        rows: of a report.
    """
    comparisons: list[Comparison] = []
    for name, judge in JUDGES.items():
        if name in rows:
            comparisons += judge(rows[name])
    return comparisons + _two_tables(rows)


def found_row(rows: Sequence[Row], **values: object) -> Row:
    """Returns the first row that has some values; an empty one where there is none.

    Args:
        rows: the rows.
        values: wanted values by key.
    """
    for row in rows:
        if all(row.get(key) == value for key, value in values.items()):
            return row
    return {}


def quotient(what: str, printed: float, numerator: Row, denominator: Row, key: str) -> Comparison:
    """Returns the comparison of a printed quotient with that of two rows' figures.

    Args:
        what: what is measured.
        printed: the quotient of the paper's figures.
        numerator: row of the numerator; an empty one where it was not run.
        denominator: row of the denominator.
        key: of the figure.
    """
    above = numerator.get(key)
    below = denominator.get(key)
    figure = above / below if above is not None and below else None
    return Comparison(what, printed, figure, _quotient_interval(numerator, denominator, key))


def _quotient_interval(numerator: Row, denominator: Row, key: str) -> list[float] | None:
    """The interval of a quotient of two rows' figures: from both on each layout where these are the
    same layouts, else the widest that both intervals allow; None where one row has none."""
    above = numerator.get(f"{key}_by_layout")
    below = denominator.get(f"{key}_by_layout")
    if above and below and numerator.get("split") == denominator.get("split"):
        return list(paired_interval(above, below))
    above_ends = numerator.get(f"{key}_interval")
    below_ends = denominator.get(f"{key}_interval")
    if not above_ends or not below_ends or None in above_ends or None in below_ends:
        return None
    if min(below_ends) <= 0.0:
        return None
    return [above_ends[0] / below_ends[1], above_ends[1] / below_ends[0]]


def sentences(rows: Rows) -> list[str]:
    """Returns what the rows say of the paper's conclusions, with their figures.

    Args:
        rows: of a report.
    """
    said = []
    for words in (_sqp_words, _temperature_words, _stages_words, _ranking_words, _tables_words):
        sentence = words(rows)
        if sentence:
            said.append(sentence)
    return said


EXACT = 0.01
"""Mean error up to which a solver that knows the plant counts as exact, on the paper's scale."""


def _sqp_words(rows: Rows) -> str:
    """Whether the printed SQP, solved to its end, is as far off as printed."""
    table = rows.get("wrench", ())
    printed = paper_figures()["wrench_tracking"]
    figures = [found_row(table, split=split, method="paper_sqp") for split in ("id", "ood")]
    if not all(figures):
        return ""
    ours = " and ".join(format_error(row["err_norm_mean"]) for row in figures)
    theirs = " and ".join(format_error(_of(printed[split], "sqp")) for split in ("id", "ood"))
    errors = (
        f"its mean errors are {ours} on seen and unseen layouts, where the paper prints {theirs}"
    )
    if max(row["err_norm_mean"] for row in figures) > EXACT:
        return f"The printed SQP does not reach its targets: {errors}."
    return (
        f"The printed SQP, solved to its end, is exact: {errors}. So the paper's main comparison, "
        "its method against this baseline, is not reproduced."
    )


def _temperature_words(rows: Rows) -> str:
    """Whether a temperature between the ends is best, as far as the table decides it."""
    usable = [row for row in rows.get("temperature", ()) if row.get("best_j_mean") is not None]
    if not usable:
        return ""
    means = [float(row["best_j_mean"]) for row in usable]
    temperatures = [float(row["temperature"]) for row in usable]
    ends = f"from {format_error(min(means))} to {format_error(max(means))}"
    span = f"between the temperatures {min(temperatures):g} and {max(temperatures):g}"
    verdicts = {comparison.verdict.word for comparison in _temperature(usable)}
    if verdicts == {"reproduced"}:
        return (
            f"A temperature between is best, as the paper draws it: the mean J goes {ends} {span}."
        )
    if verdicts == {"not"}:
        return (
            f"The temperature of the draw is flat: the mean J goes {ends} {span}, where the paper "
            "draws an optimum between."
        )
    best = temperatures[means.index(min(means))]
    figures = f"the mean J goes {ends} {span}, and is least at {best:g}"
    if "not" in verdicts:
        return f"No temperature between is clearly best, where the paper draws one: {figures}."
    return (
        "Whether a temperature between is best, as the paper draws it, cannot be decided: "
        f"{figures}."
    )


def _stage(rows: Rows, variant: str) -> float | None:
    """Mean J_norm by the plant of a variant of the pipeline; None where it was not run."""
    row = found_row(rows.get("ablation", ()), variant=variant, scored_by="plant")
    return row.get("j_norm_mean")


def _stages_words(rows: Rows) -> str:
    """Which of the two rows without refinement is better."""
    mean = _stage(rows, "mean_only")
    drawn = _stage(rows, "without_refinement")
    if mean is None or drawn is None:
        return ""
    printed = paper_figures()["ablation"]
    theirs = [printed[name]["err_norm_mean"] for name in ("mean_only", "without_refinement")]
    figures = (
        f"J_norm is {format_error(mean)} for the mixture's mean and {format_error(drawn)} for the "
        f"best draw, the paper prints {format_error(theirs[0])} and {format_error(theirs[1])}"
    )
    if mean > drawn:
        return f"The mixture's mean and the best draw change places: {figures}."
    return f"The mixture's mean is better than the best draw, as in the paper: {figures}."


def _ranking_words(rows: Rows) -> str:
    """What ranking by physics brings."""
    table = rows.get("ablation", ())
    likely = found_row(table, variant="nll_selection", scored_by="plant")
    ours = found_row(table, variant="ours", scored_by="plant")
    printed = paper_figures()["ablation"]
    theirs = printed["nll_selection"]["err_norm_mean"] / printed["ours"]["err_norm_mean"]
    gain = quotient("", theirs, likely, ours, "j_norm_mean")
    if gain.figure is None:
        return ""
    ends = ""
    if gain.interval is not None and None not in gain.interval:
        low, high = (format_digits(end, 2) for end in gain.interval if end is not None)
        ends = f" ({low} to {high})"
    return (
        f"Ranking by physics is {format_digits(gain.figure, 2)} times{ends} better than by "
        f"likelihood in J_norm, by the plant; the paper prints {format_digits(theirs, 2)}."
    )


def _tables_words(rows: Rows) -> str:
    """That the paper's two tables of one pipeline contradict each other."""
    if not _two_tables(rows):
        return ""
    root_of_j_norm = math.sqrt(paper_figures()["ablation"]["ours"]["err_norm_mean"])
    tracking = paper_figures()["wrench_tracking"]["id"]["ours"]["err_norm_mean"]
    ours = found_row(rows["wrench"], split="id", method="paper")["err_norm_mean"]
    stage = _stage(rows, "ours")
    assert stage is not None
    return (
        "The paper's two tables contradict each other: the same pipeline errs by "
        f"{format_error(root_of_j_norm)}, the root of J_norm in its ablation, and by "
        f"{format_error(tracking)} in its table of layouts. Ours errs by "
        f"{format_error(math.sqrt(stage))} and {format_error(ours)}."
    )


def _wrench(rows: Sequence[Row]) -> list[Comparison]:
    """Baselines over the paper's method, and unseen layouts over seen ones."""
    printed = paper_figures()["wrench_tracking"]
    judged = []
    for split in ("id", "ood"):
        ours = found_row(rows, split=split, method="paper")
        for printed_name, method in (("qp", "qp"), ("sqp", "paper_sqp")):
            baseline = found_row(rows, split=split, method=method)
            ratio = _of(printed[split], printed_name) / _of(printed[split], "ours")
            what = f"error of the printed {printed_name.upper()} over the paper's method, {split}"
            judged.append(quotient(what, ratio, baseline, ours, "err_norm_mean"))
    for printed_name, method in (("ours", "paper"), ("qp", "qp"), ("sqp", "paper_sqp")):
        ratio = _of(printed["ood"], printed_name) / _of(printed["id"], printed_name)
        what = f"error on unseen layouts over that on seen ones, {method}"
        unseen = found_row(rows, split="ood", method=method)
        seen = found_row(rows, split="id", method=method)
        judged.append(quotient(what, ratio, unseen, seen, "err_norm_mean"))
    return judged


def _of(table: Mapping[str, Mapping[str, float]], name: str) -> float:
    """Mean error that the paper prints for a method."""
    return float(table[name]["err_norm_mean"])


def _ablation(rows: Sequence[Row]) -> list[Comparison]:
    """What each stage of the pipeline brings, and whether the paper's two tables agree."""
    printed = paper_figures()["ablation"]
    err_of_pipeline = printed["ours"]["err_norm_mean"]
    ours = found_row(rows, variant="ours", scored_by="plant")
    judged = []
    words = {
        "mean_only": "J_norm of the mixture's mean over the whole pipeline",
        "without_refinement": "J_norm without refinement over the whole pipeline",
        "nll_selection": "J_norm ranked by likelihood over ranked by physics",
        "random_warm_start": "J_norm from a random start over that from the network",
    }
    for variant, what in words.items():
        row = found_row(rows, variant=variant, scored_by="plant")
        ratio = printed[variant]["err_norm_mean"] / err_of_pipeline
        judged.append(quotient(what, ratio, row, ours, "j_norm_mean"))
    mean = found_row(rows, variant="mean_only", scored_by="plant")
    drawn = found_row(rows, variant="without_refinement", scored_by="plant")
    ratio = printed["mean_only"]["err_norm_mean"] / printed["without_refinement"]["err_norm_mean"]
    what = "J_norm of the mixture's mean over the best draw, neither refined"
    judged.append(quotient(what, ratio, mean, drawn, "j_norm_mean"))
    return judged


def _two_tables(rows: Rows) -> list[Comparison]:
    """The error of one pipeline by the two tables that have it: in the paper they contradict each
    other."""
    err_of_pipeline = paper_figures()["ablation"]["ours"]["err_norm_mean"]
    tracking = paper_figures()["wrench_tracking"]["id"]["ours"]["err_norm_mean"]
    ours = found_row(rows.get("wrench", ()), split="id", method="paper")
    stage = found_row(rows.get("ablation", ()), variant="ours", scored_by="plant")
    if not ours or not stage:
        return []
    return [
        Comparison(
            "error of the whole pipeline in the table of layouts over the root of its J_norm in "
            "the ablation",
            tracking / math.sqrt(err_of_pipeline),
            ours["err_norm_mean"] / math.sqrt(stage["j_norm_mean"]),
            None,
            f"The paper's two tables contradict each other: {math.sqrt(err_of_pipeline):.3f} and "
            f"{tracking:.3f} for one pipeline.",
        )
    ]


def _temperature(rows: Sequence[Row]) -> list[Comparison]:
    """Whether the best temperature lies between the extremes, as the paper draws it without
    numbers: J at both over the least, which is clearly more than 1 where there is an optimum."""
    usable = [row for row in rows if row.get("best_j_mean") is not None]
    if not usable:
        return []
    usable = sorted(usable, key=lambda row: float(row["temperature"]))
    least = min(usable, key=lambda row: float(row["best_j_mean"]))
    judged = []
    for name, row in (("lowest", usable[0]), ("highest", usable[-1])):
        what = f"J at the {name} temperature, {row['temperature']:g}, over the least, at least"
        judged.append(replace(quotient(what, NEAR, row, least, "best_j_mean"), at_least=True))
    return judged


def _velocity(rows: Sequence[Row]) -> list[Comparison]:
    """Power and error of the paper's method over its baseline."""
    printed = paper_figures()["velocity"]
    judged = []
    about = {"lost": 0, "speed": None, "controller": "velocity"}
    words = {"inertial_w": "inertial power", "mae": "error of the speed"}
    for layout in dict.fromkeys(row["layout"] for row in rows):
        ours = found_row(rows, layout=layout, method="paper", **about)
        base = found_row(rows, layout=layout, method="fixed_frequency", **about)
        for key, noun in words.items():
            ratio = printed["ours"][key] / printed["baseline"][key]
            what = f"{noun} of the paper's method over its baseline, layout {layout}"
            judged.append(quotient(what, ratio, ours, base, key))
    return judged


def _trajectory(rows: Sequence[Row]) -> list[Comparison]:
    """How much one and two lost fins add to the error, on layout A, that of the paper's pool."""
    printed = paper_figures()["fault_tolerance"]
    healthy = printed["healthy"]["ours"]["ate"]
    about = {"layout": "A", "controller": "waypoint", "method": "paper"}
    undamaged = found_row(rows, lost=0, **about)
    judged = []
    for count, name in ((1, "one_fin"), (2, "two_fins")):
        ratio = printed[name]["ours"]["ate"] / healthy
        what = f"ATE with {count} lost over that of the whole robot, layout A"
        damaged = found_row(rows, lost=count, **about)
        compared = quotient(what, ratio, damaged, undamaged, "ate")
        judged.append(replace(compared, obstacle=OTHER_FIN))
    return judged


OTHER_FIN = (
    "The paper does not say which fins were lost; by which one, ours differ more than this "
    "(section Faults)."
)
"""Why figures of lost fins cannot be compared."""


JUDGES: Mapping[str, Callable[[Sequence[Row]], list[Comparison]]] = {
    "wrench": _wrench,
    "ablation": _ablation,
    "temperature": _temperature,
    "trajectory": _trajectory,
    "velocity": _velocity,
}
"""Experiment -> what its rows say of the paper's conclusions."""
