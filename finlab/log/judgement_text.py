"""Shows a judgement of a log: as text, and as a picture of its timeline (extra `plot`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from finlab.axes import AXES, MOTIONS, UNITS
from finlab.display.figures import COLORS, panels
from finlab.log.judgement import Judgement, Spell
from finlab.research.evaluation.document import Column, ReportBlock, ReportTable, Row, to_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

IMPULSE_UNITS = [f"{unit} s" for unit in UNITS]
"""Units of an impulse along each axis."""
MAX_SPELLS = 10
"""Most spells in the text."""
MAX_EVENTS = 10
"""Most events in the text."""


def judgement_text(judgement: Judgement) -> str:
    """Returns the sentence, then the loss of each axis, the longest spells, and the replays."""
    columns = (
        Column("axis", "axis"),
        Column("unit", "unit"),
        Column("asked", "asked for", "three"),
        Column("missing", "missing", "three"),
        Column("lost", "lost [s]", "three"),
    )
    rows: list[Row] = []
    for k, axis in enumerate(AXES):
        rows.append(
            {
                "axis": f"{MOTIONS[k]} {axis}",
                "unit": IMPULSE_UNITS[k],
                "asked": judgement.asked[k],
                "missing": judgement.missing[k],
                "lost": judgement.lost_s[k],
            }
        )
    blocks: list[ReportBlock] = [judgement.sentence, ReportTable(columns, rows)]
    longest = sorted(judgement.spells, key=lambda spell: spell.start - spell.end)[:MAX_SPELLS]
    for spell in sorted(longest, key=lambda spell: spell.start):
        blocks.append(_spell_line(spell))
    blocks.append(_replay_table(judgement))
    blocks += [f"{time:.1f} s: {words}" for time, words in judgement.events[:MAX_EVENTS]]
    if judgement.watts is not None:
        blocks.append(
            f"The outputs took {judgement.watts:.3g} W on average, by the actuators' own models."
        )
    return to_text(*blocks, *judgement.asks, *judgement.notes)


def _spell_line(spell: Spell) -> str:
    """A spell in a line: its times, the wrench given of that demanded, and the limits."""
    shares = []
    for k, axis in enumerate(AXES):
        if axis in spell.axes:
            shares.append(f"{axis} {spell.gave[k]:.3g} of {spell.asked[k]:.3g}")
    limits = ", ".join(spell.limits) or "no limit known"
    return f"{spell.start:.1f} to {spell.end:.1f} s: {', '.join(shares)}; {limits}"


def _replay_table(judgement: Judgement) -> ReportTable:
    """Replays on the robot and the improved one; of those with an actuator lost only the
    autopilots' and the best method."""
    best = judgement.held_by
    methods_without = {"px4", "ardusub"}
    if best is not None:
        methods_without.add(best.name)
    rows: list[Row] = []
    for replay in judgement.replays:
        if replay.lost is not None and replay.name not in methods_without:
            continue
        row: Row = dict(vars(replay))
        row |= dict(zip(AXES, replay.missing, strict=True))
        row["robot"] = replay.robot if replay.lost is None else f"without {replay.lost}"
        row["_kind"] = "ours" if replay == best else ""
        rows.append(row)
    columns = [Column("robot", "robot"), Column("name", "method")]
    for axis, unit in zip(AXES, IMPULSE_UNITS, strict=True):
        columns.append(Column(axis, axis, "three", unit=unit))
    columns.append(Column("watts", "power", "three", unit="W"))
    columns.append(Column("saturated_s", "short", "three", unit="s"))
    return ReportTable(tuple(columns), rows)


def timeline_picture(judgement: Judgement) -> Figure:
    """Returns a figure of the demanded and the delivered wrench over time, along each axis that was
    demanded, and of the actuators at limits."""
    timeline = judgement.timeline
    time = timeline.time
    names = judgement.robot.names
    threshold = 1e-3 * max(judgement.asked)
    shown = [k for k in range(6) if judgement.asked[k] > threshold] or [0]
    figure, rows = panels((9.0, 1.6 * len(shown) + 2.2), len(shown) + 1, sharex=True)
    *wrench_axes, limit_axes = rows[:, 0]
    for k, axes in zip(shown, wrench_axes, strict=True):
        demand = timeline.demand[:, k]
        given = timeline.given[:, k]
        axes.step(time, demand, where="post", color="0.55", label="asked for")
        axes.step(time, given, where="post", color=COLORS[0], label="given")
        axes.fill_between(
            time,
            demand,
            given,
            where=np.abs(timeline.missing[:, k]) > 0.0,
            step="post",
            color=COLORS[1],
            alpha=0.5,
            lw=0,
            label="missing",
        )
        axes.set_ylabel(f"{MOTIONS[k]} [{UNITS[k]}]")
    wrench_axes[0].legend(loc="upper right", ncols=3, fontsize="small")
    edges = np.append(time, time[-1] + judgement.seconds / len(time))
    limit_axes.pcolormesh(
        edges, np.arange(len(names) + 1), timeline.limits.T, cmap="Oranges", vmin=0.0, vmax=1.0
    )
    limit_axes.set_yticks(np.arange(len(names)) + 0.5, names, fontsize="x-small")
    limit_axes.set(ylabel="at a limit", xlabel="time of the log [s]")
    figure.suptitle(judgement.source)
    return figure
