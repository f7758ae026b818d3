"""A judgement of a log as text, and as a picture of its timeline by matplotlib (extra `plot`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from finlab.analysis.authority import AXES as MOTIONS
from finlab.axes import AXES, UNITS
from finlab.display.figures import COLORS, panels
from finlab.log.judgement import Judgement
from finlab.research.evaluation.document import Column, ReportBlock, ReportTable, Row, to_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

IMPULSES = [f"{unit} s" for unit in UNITS]
MOST_SPELLS, MOST_EVENTS = 10, 10
"""Most spells and events that the text tells."""


def judgement_text(judged: Judgement) -> str:
    """The sentence, then what was lost on each axis, when, and what each replay misses."""
    columns = [
        Column("axis", "axis"),
        Column("unit", "unit"),
        Column("asked", "asked for", "three"),
    ]
    columns += [Column("missing", "missing", "three"), Column("lost", "lost [s]", "three")]
    names = [f"{motion} {axis}" for motion, axis in zip(MOTIONS, AXES, strict=True)]
    each = zip(names, IMPULSES, judged.asked, judged.missing, judged.lost_s, strict=True)
    rows: list[Row] = [
        dict(zip([column.key for column in columns], row, strict=True)) for row in each
    ]
    blocks: list[ReportBlock] = [judged.sentence, ReportTable(tuple(columns), rows)]
    worst = sorted(judged.spells, key=lambda spell: spell.start - spell.end)[:MOST_SPELLS]
    for spell in sorted(worst, key=lambda spell: spell.start):
        places = [k for k, axis in enumerate(AXES) if axis in spell.axes]
        axes = ", ".join(f"{AXES[k]} {spell.gave[k]:.3g} of {spell.asked[k]:.3g}" for k in places)
        blocks.append(
            f"{spell.start:.1f} to {spell.end:.1f} s: {axes}; "
            f"{', '.join(spell.limits) or 'no limit known'}"
        )
    blocks.append(_replays(judged))
    blocks += [f"{time:.1f} s: {words}" for time, words in judged.events[:MOST_EVENTS]]
    if judged.watts is not None:
        blocks.append(
            f"The outputs took {judged.watts:.3g} W on average, by the actuators' own models."
        )
    return to_text(*blocks, *judged.asks, *judged.notes)


def _replays(judged: Judgement) -> ReportTable:
    """Replays on the robot and the improved one, and, with each actuator lost, the best and the
    log's own."""
    own = {"px4", "ardusub", "" if judged.held_by is None else judged.held_by.name}
    rows: list[Row] = [
        vars(each)
        | {axis: missing for axis, missing in zip(AXES, each.missing, strict=True)}
        | {"robot": each.robot if each.lost is None else f"without {each.lost}"}
        | {"_kind": "ours" if each == judged.held_by else ""}
        for each in judged.replays
        if each.lost is None or each.name in own
    ]
    columns = [Column("robot", "robot"), Column("name", "method")]
    columns += [
        Column(axis, axis, "three", unit=unit) for axis, unit in zip(AXES, IMPULSES, strict=True)
    ]
    columns += [
        Column("watts", "power", "three", unit="W"),
        Column("saturated_s", "short", "three", unit="s"),
    ]
    return ReportTable(tuple(columns), rows)


def timeline_picture(judged: Judgement) -> Figure:
    """Demand and what the outputs gave over time, of each axis asked for, and actuators at
    limits."""
    line = judged.timeline
    names = judged.robot.names
    shown = [k for k in range(6) if judged.asked[k] > 1e-3 * max(judged.asked)] or [0]
    figure, rows = panels((9.0, 1.6 * len(shown) + 2.2), len(shown) + 1, sharex=True)
    *upper, last = rows[:, 0]
    for k, axes in zip(shown, upper, strict=True):
        axes.step(line.time, line.demand[:, k], where="post", color="0.55", label="asked for")
        axes.step(line.time, line.given[:, k], where="post", color=COLORS[0], label="given")
        cut = np.abs(line.missing[:, k]) > 0.0
        ends = {"step": "post", "color": COLORS[1], "alpha": 0.5, "lw": 0, "label": "missing"}
        axes.fill_between(line.time, line.demand[:, k], line.given[:, k], where=cut, **ends)
        axes.set_ylabel(f"{MOTIONS[k]} [{UNITS[k]}]")
    upper[0].legend(loc="upper right", ncols=3, fontsize="small")
    edges = np.append(line.time, line.time[-1] + judged.seconds / len(line.time))
    last.pcolormesh(
        edges, np.arange(len(names) + 1), line.limits.T, cmap="Oranges", vmin=0.0, vmax=1.0
    )
    last.set_yticks(np.arange(len(names)) + 0.5, names, fontsize="x-small")
    last.set(ylabel="at a limit", xlabel="time of the log [s]")
    figure.suptitle(judged.source)
    return figure
