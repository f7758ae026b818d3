"""Hard days: who swims them how well, in a table, and where our method does not lead in words."""

from collections.abc import Sequence

from finlab.control.completion import LEVER_M
from finlab.evaluation.experiments.closed_loop_runs import LOST_M, RTE_DELTA_S
from finlab.evaluation.experiments.hard_days import HARD_DAYS, HardDay
from finlab.evaluation.experiments.swims import (
    GAP_N,
    TITLES,
    Swim,
    duels,
    goal_sentences,
    not_swum,
    swim_rows,
)
from finlab.evaluation.report.document import Block, Column, Row, Table, method_row

WHAT = (Column("scenario", "scenario"), Column("method", "method"), Column("swims", "swims", "count"))
ERRORS = (
    Column("ate", "ATE [m]", "metres", "ate_interval"),
    Column("ate_ratio", "over best", "ratio", "ate_ratio_interval"),
    Column("rte", "RTE [m]", "metres"),
    Column("depth_rmse", "depth RMSE [m]", "metres"),
    Column("driving_w", "power [W]", "three", "driving_w_interval"),
    Column("driving_w_ratio", "over best", "ratio", "driving_w_ratio_interval"),
    Column("peak_w", "peak [W]", "three"),
    Column("lost", "lost", "count"),
    Column("verdict", "verdict"),
)
STEPS = (
    Column("turn", "turn [rad]", "ratio"),
    Column("frequency_step", "frequency [Hz]", "ratio"),
    Column("amplitude_step", "amplitude [rad]", "ratio"),
    Column("rests_per_min", "rest and work / min", "three"),
    Column("out_of_reach", "out of reach", "share"),
    Column("cpu_s_per_min", "CPU s / min", "three"),
)
ABOUT = (
    "All methods swim with one controller, which follows position, velocity and acceleration, under the same "
    "noise. `search` takes from it the wrenches that it expects, the others the present one."
)
SLOW = (
    "{} swam the same days with the same seeds and noise, each swim set against "
    "that of `search`. They take several times the processor's time that a pseudo-inverse takes, and are run "
    "by `finlab eval report -o DIR --sections slow-days`. *Over it*: `search` over the method of the row."
)
DUEL = (
    Column("ate", "ATE [m]", "metres"),
    Column("ours_ate", "`search`", "metres"),
    Column("ate_ratio", "over it", "ratio", "ate_ratio_interval"),
    Column("rte", "RTE [m]", "metres"),
    Column("depth_rmse", "depth RMSE [m]", "metres"),
    Column("driving_w", "power [W]", "three"),
    Column("ours_driving_w", "`search`", "three"),
    Column("driving_w_ratio", "over it", "ratio", "driving_w_ratio_interval"),
    Column("peak_w", "peak [W]", "three"),
    Column("lost", "lost", "count"),
    Column("verdict", "`search`"),
)
LEADS = "error better, power better"


def swim_blocks(days: Sequence[HardDay], rows: Sequence[Row], hopeless: Sequence[Row]) -> list[Block]:
    """What the days are, errors and watts, steps per tick, and what is not won."""
    shown = [method_row(row) for row in rows]
    blocks: list[Block] = [
        "### Hard days",
        "\n".join(f"- `{day.name}` ({', '.join(day.layouts)}): {day.about}" for day in days),
        Table((*WHAT, *ERRORS), shown),
        (
            f"*Means over swims; peaks are the largest. RTE over {RTE_DELTA_S:g} s. Power with the motors' "
            "losses. Intervals over seeds, where another seed should land: of means by bootstrap, of ratios "
            "by Student's t, each swim against that of the same case and noise; a verdict needs an interval "
            "without 1. Best: the least of the baselines that keep their reference, "
            f"for error and power each. Lost: swims that were ever farther than {LOST_M:g} m away.*"
        ),
        Table((*WHAT, *STEPS), shown),
        (
            "*Largest change of a command from tick to tick, of fins that beat before and after; changes of "
            f"all fins between rest and work; share of ticks at which commands miss more than {GAP_N:g} N of "
            f"what is asked, torques at {LEVER_M:g} m, by the law that methods know, a monitor's probing "
            "included; processor's time, simulation included.*"
        ),
    ]
    if hopeless:
        blocks += ["Not swum:", "\n".join(f"- `{row['scenario']}`: {row['reason']}." for row in hopeless)]
    reasons = {day.name: day.reason for day in days}
    missed = [row for row in rows if _not_won(row)]
    if sentences := [_sentence(row, reasons.get(row["scenario"], "")) for row in missed]:
        blocks += ["Not won in error and power both:", "\n".join(f"- {sentence}" for sentence in sentences)]
    if goals := goal_sentences(days, rows):
        blocks += ["Goals:", "\n".join(f"- {sentence}." for sentence in goals)]
    return blocks


def day_blocks(swims: Sequence[Row]) -> list[Block]:
    """The section of a whole report, from single swims as `Swim` names their figures."""
    done = [Swim(**swim) for swim in swims]
    names = dict.fromkeys(swim.scenario for swim in done)
    days = [day for day in HARD_DAYS if day.name in names]
    title, *blocks = swim_blocks(days, swim_rows(done), not_swum(days))
    return [title, ABOUT, *blocks]


def slow_day_blocks(swims: Sequence[Row], slow: Sequence[Row]) -> list[Block]:
    """The slow methods against `search` on the hard days, from single swims as `Swim` names their figures."""
    ours = [Swim(**swim) for swim in swims if swim["method"] == "search"]
    rows = duels(ours, [Swim(**swim) for swim in slow])
    methods = list(dict.fromkeys(row["method"] for row in rows))
    first, last = ", ".join(f"`{method}`" for method in methods[:-1]), f"`{methods[-1]}`"
    return [
        "### Hard days, slow methods",
        SLOW.format(f"{first} and {last}" if first else last),
        Table((*WHAT, *DUEL), rows),
        Table((*WHAT, *STEPS), rows),
        "\n".join(f"- {_against(method, rows)}" for method in methods),
    ]


def _against(method: str, rows: Sequence[Row]) -> str:
    """How `search` fares against one slow method over all days, in a sentence."""
    mine = [row for row in rows if row["method"] == method]
    said = []
    for key, title in TITLES.items():
        found = [row for row in mine if f"{key}_ratio" in row]
        days = {
            verdict: [row["scenario"] for row in found if row.get(f"{key}_verdict") == verdict]
            for verdict in ("better", "worse")
        }
        ratios = sorted(row[f"{key}_ratio"] for row in found)
        worse = f" ({', '.join(f'`{day}`' for day in days['worse'])})" if days["worse"] else ""
        between = f", at {ratios[0]:.2f} to {ratios[-1]:.2f} of its {title}" if ratios else ""
        said.append(
            f"{title} better on {len(days['better'])} and worse on {len(days['worse'])} of {len(mine)} "
            f"days{worse}{between}"
        )
    lost, swims = (sum(row[key] for row in mine) for key in ("lost", "swims"))
    return f"`search` against `{method}`: {'; '.join(said)}. `{method}` loses its path on {lost} of {swims}."


def _not_won(row: Row) -> bool:
    """Whether one of our rows does not lead in both figures; of a single seed the ratios alone count."""
    if row.get("verdict") == "":
        return bool(max(row["ate_ratio"], row["driving_w_ratio"]) >= 1.0)
    return bool(row.get("verdict", LEADS) != LEADS)


def _sentence(row: Row, reason: str) -> str:
    about = f"`{row['scenario']}`, `{row['method']}`: {row['verdict'] or 'one seed has no interval'}"
    because = f" {reason}" if reason else ""
    if "ate_ratio" not in row:
        return f"{about}.{because}"
    return (
        f"{about}; error {row['ate_ratio']:.2f} of that of `{row['ate_best']}`, power "
        f"{row['driving_w_ratio']:.2f} of that of `{row['driving_w_best']}`.{because}"
    )
