"""A judgement of a log in words: the columns and rows of its tables, and all of it as text.

`finlab log` prints them, and the app's panels (`webapp/panels/log_tab.py`) show them.
"""

from __future__ import annotations

import textwrap
from typing import NamedTuple

import numpy as np

from finlab.analysis.second_losses import PAIR_COLUMNS, pair_blocks
from finlab.axes import AXES, MOTIONS, UNITS
from finlab.display import Block, Column, table_of, text
from finlab.log.judgement import DEMANDED_SHARE, Judgement, Spell
from finlab.log.replay import Replay

TEXT_WIDTH = 110
"""Most characters in a line of sentences."""
MAX_SPELLS = 10
"""Most spells in the text; the app lists them all."""
MAX_EVENTS = 10
"""Most events in the text."""


class ImpulseRow(NamedTuple):
    """What a robot was asked for along one axis, and what it lacked; an impulse is the integral
    over time of a size."""

    motion: str
    axis: str
    unit: str
    """Of impulses along this axis."""
    asked: float
    """Impulse that was asked for [N s or N m s]."""
    missing: float
    """Impulse that was missing while an actuator was at a limit [N s or N m s]."""
    lost_s: float
    """Time over which the axis was lost [s]."""


IMPULSE_COLUMNS = (
    Column("impulse", lambda row: f"{row.motion} {row.axis}", is_text=True),
    Column("unit", lambda row: row.unit, is_text=True),
    Column("asked", lambda row: row.asked),
    Column("missing", lambda row: row.missing),
    Column("lost", lambda row: row.lost_s, "s"),
)
"""Columns of the table of axes; a row is an `ImpulseRow`."""
SPELL_COLUMNS = (
    Column("when [s]", lambda spell: f"{spell.start:.1f} to {spell.end:.1f}", is_text=True),
    Column("given of asked", lambda spell: lost_words(spell), is_text=True),
    Column("at a limit", lambda spell: ", ".join(spell.limits) or "no limit known", is_text=True),
)
"""Columns of the table of spells; a row is a `Spell`."""
REPLAY_NAMES = (
    Column("robot", lambda replay: robot_words(replay), is_text=True),
    Column("method", lambda replay: replay.name, is_text=True),
)
"""First columns of the table of replays, which say what a row, a `Replay`, is of."""
REPLAY_COSTS = (
    Column("power", lambda replay: replay.watts, "W"),
    Column(
        "short",
        lambda replay: replay.saturated_s,
        "s",
        hint="time over which something was missing",
    ),
)
"""Last columns of the table of replays."""


def missing_column(axis: int) -> Column:
    """Returns the column of what replays miss along an axis, by its index."""
    hint = f"what was missing along {MOTIONS[axis]}"
    return Column(
        AXES[axis], lambda replay: replay.missing[axis], unit=f"{UNITS[axis]} s", hint=hint
    )


def _missed_axes(judgement: Judgement) -> list[int]:
    """Indices of the axes that were demanded, or along which a replay gives what was not."""
    least = DEMANDED_SHARE * max(judgement.asked)
    axes = []
    for k in range(len(AXES)):
        most = max((replay.missing[k] for replay in judgement.replays), default=0.0)
        if k in judgement.demanded_axes or most > least:
            axes.append(k)
    return axes


def lost_words(spell: Spell) -> str:
    """Returns what was given of what was asked for on each axis of a spell: `Tz 3.10 of 18.0`."""
    shares = []
    for k, axis in enumerate(AXES):
        if axis in spell.axes:
            shares.append(f"{axis} {spell.gave[k]:.3g} of {spell.asked[k]:.3g}")
    return ", ".join(shares)


def robot_words(replay: Replay) -> str:
    """Returns the robot of a replay: as it is, improved, or without one actuator."""
    return replay.robot if replay.lost is None else f"without {replay.lost}"


def impulse_rows(judgement: Judgement) -> list[ImpulseRow]:
    """Returns a row for each axis that was demanded."""
    rows = []
    for k in judgement.demanded_axes:
        row = ImpulseRow(
            motion=MOTIONS[k],
            axis=AXES[k],
            unit=f"{UNITS[k]} s",
            asked=judgement.asked[k],
            missing=judgement.missing[k],
            lost_s=judgement.lost_s[k],
        )
        rows.append(row)
    return rows


def judged_axis(judgement: Judgement) -> int:
    """Returns the index of the axis that lost most; where none was lost, of the one that was asked
    for most."""
    if judgement.axis is not None:
        return AXES.index(judgement.axis)
    return int(np.argmax(judgement.asked))


def judgement_text(judgement: Judgement) -> str:
    """Returns the sentence, then the loss of each axis, the longest spells, the replays, and the
    fatal pairs of losses."""
    longest = sorted(judgement.spells, key=lambda spell: spell.start - spell.end)[:MAX_SPELLS]
    spells = sorted(longest, key=lambda spell: spell.start)
    blocks: list[Block] = [textwrap.fill(judgement.sentence, TEXT_WIDTH)]
    blocks.append(table_of(IMPULSE_COLUMNS, impulse_rows(judgement)))
    if spells:
        blocks.append(table_of(SPELL_COLUMNS, spells))
    # A terminal is wide enough for more than the one axis that the app's drawer has.
    missing = [missing_column(k) for k in _missed_axes(judgement)]
    columns = (*REPLAY_NAMES, *missing, *REPLAY_COSTS)
    title = "What each method misses along the axes, on the same demands:"
    blocks.append(table_of(columns, _replays_in_text(judgement), title))
    blocks += _pair_blocks(judgement)
    blocks += [f"{time:.1f} s: {words}" for time, words in judgement.events[:MAX_EVENTS]]
    sentences = [*judgement.asks, *judgement.notes]
    if judgement.watts is not None:
        power = f"{judgement.watts:.3g} W"
        sentences.insert(0, f"The outputs took {power} on average, by the actuators' own models.")
    blocks += [textwrap.fill(sentence, TEXT_WIDTH) for sentence in sentences]
    return text(blocks)


def _pair_blocks(judgement: Judgement) -> list[Block]:
    """The fatal pairs of losses; where an actuator was stopped, which loss would be the next."""
    pairs = judgement.second_losses
    without = judgement.without
    if without is None:
        return pair_blocks(pairs, judgement.robot.n)
    if not pairs:
        return [f"Without {without} no loss of one more takes an axis away that it alone leaves."]
    title = f"Without {without}, the loss of one of these takes away:"
    other = Column(
        "next", lambda pair: pair.second if pair.first == without else pair.first, is_text=True
    )
    return [table_of((other, PAIR_COLUMNS[-1]), pairs, title)]


def _replays_in_text(judgement: Judgement) -> list[Replay]:
    """Replays on the robot and the improved one; of those with an actuator lost only the
    autopilots' and the best method, as there are so many of them."""
    best = judgement.held_by
    methods_without = {"px4", "ardusub"}
    if best is not None:
        methods_without.add(best.name)
    replays = []
    for replay in judgement.replays:
        if replay.lost is None or replay.name in methods_without:
            replays.append(replay)
    return replays
