"""A capability plot in words: its sentences and the columns of its table, and its picture."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from finlab.display import Block, Column, listed, prefix_of, table_of, three_digits

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Capability = Any
"""`finlab.analysis.Capability`, which shows itself by what is here."""
FEW_HEADINGS = 4
"""Most headings that a sentence names."""


class HeadingRow(NamedTuple):
    """What a plot says of one heading."""

    heading: float
    """Where the load comes from [deg]."""
    value: float
    """Of the robot as it is."""
    worst: float
    """After the worst single loss."""
    worst_case: str
    """Which loss that is."""
    limited_by: str
    """What limits the robot as it is: thrust, or power."""
    worst_limited_by: str
    """The same after the worst single loss."""
    costs: dict[str, float]
    """Share of the load that each loss of thrust costs at the limiting condition [1]."""


def _cost(row: HeadingRow, name: str) -> float:
    """What a loss of thrust costs at a heading [1]."""
    return row.costs[name]


def heading_rows(capability: Capability) -> list[HeadingRow]:
    """Returns a row for each heading."""
    worst_case = capability.worst_case
    limited_by = capability.limited_by[0]
    worst_limited_by = capability.worst_limited_by
    rows = []
    for h, heading in enumerate(capability.headings):
        rows.append(
            HeadingRow(
                heading=heading,
                value=float(capability.values[0, h]),
                worst=float(capability.worst[h]),
                worst_case=worst_case[h],
                limited_by=limited_by[h],
                worst_limited_by=worst_limited_by[h],
                costs={name: float(cost[h]) for name, cost in capability.loss_costs.items()},
            )
        )
    return rows


class Shown(NamedTuple):
    """How the values of a plot are shown."""

    words: str
    """What they are."""
    unit: str
    """Their unit; empty of shares and numbers of Beaufort."""
    scale: float
    """Factor from the plot's unit to that one."""
    digits: Callable[[float], str]
    """Scaled value -> its text."""


def shown_values(capability: Capability) -> Shown:
    """Returns how the values of a plot are shown, by its unit and its largest value."""
    if capability.standard is not None:
        return Shown("DP capability number", "", 1.0, lambda value: f"{value:.0f}")
    if capability.unit == "1":
        return Shown("share of the load", "", 1.0, three_digits)
    prefix = prefix_of(float(capability.values.max(initial=0.0)))
    return Shown("largest force", f"{prefix.symbol}N", 1.0 / prefix.factor, three_digits)


def capability_columns(capability: Capability) -> tuple[Column, ...]:
    """Returns the columns of the table; a row is a `HeadingRow`."""
    _, unit, scale, digits = shown_values(capability)
    columns = [
        Column("heading", lambda row: row.heading, "deg", digits=lambda value: f"{value:g}"),
        Column("intact", lambda row: scale * row.value, unit, digits=digits),
        Column("one lost", lambda row: scale * row.worst, unit, digits=digits),
        Column("worst without", lambda row: row.worst_case, is_text=True),
    ]
    if capability.buses:
        columns += [
            Column("intact limited by", lambda row: row.limited_by, is_text=True),
            Column("then limited by", lambda row: row.worst_limited_by, is_text=True),
        ]
    for name in capability.loss_costs:
        columns.append(
            Column(
                name,
                partial(_cost, name=name),
                digits=lambda cost: f"{100.0 * cost:.1f} %",
                hint="what this loss of thrust costs of the load that can be held",
            )
        )
    return tuple(columns)


def capability_remarks(capability: Capability) -> list[str]:
    """Returns sentences about the plot: the notation, the weakest heading, and what is proved."""
    sentences = []
    if capability.notation is not None:
        numbers = ", ".join(str(number) for number in capability.notation)
        sentences.append(f"DP capability-L1({numbers}).")
    words = "" if capability.standard is None else f" ({capability.standard})"
    worst = capability.worst
    least = float(worst.min())
    weakest = np.flatnonzero(worst <= least * (1.0 + 1e-6))
    names = [f"{capability.headings[h]:g}" for h in weakest[:FEW_HEADINGS]]
    if len(weakest) > FEW_HEADINGS:
        names.append("others")
    shown = shown_values(capability)
    value = " ".join([shown.digits(shown.scale * least), shown.unit]).rstrip()
    case = capability.worst_case[weakest[0]]
    lost = "intact" if len(capability.cases) == 1 else f"without {case}"
    sentences.append(
        f"{capability.layout}{words} is weakest from {listed(names)} deg: {shown.words} {value}, "
        f"{lost}."
    )
    if capability.buses:
        sentences.append(_words_on_power(capability))
    n_refused = int((~capability.held).sum()) if capability.unit != "N" else 0
    if n_refused:
        sentences.append(
            f"{n_refused} of {capability.held.size} loads cannot be held; each has a certificate."
        )
    return sentences


def _words_on_power(capability: Capability) -> str:
    """Where power limits a plot with budgets."""
    n_headings = len(capability.headings)
    intact = int(capability.binding_buses[0].any(axis=-1).sum())
    if not intact and not capability.worst_binding_buses.any():
        return "The power budget limits no heading."
    words = f"Power limits {intact} of {n_headings} headings"
    if len(capability.cases) == 1:
        return f"{words}."
    lost = int(capability.worst_binding_buses.any(axis=-1).sum())
    return f"{words}, and {lost} after the worst single loss; thrust limits the others."


def capability_blocks(capability: Capability) -> list[Block]:
    """Returns the sentences and the table."""
    table = table_of(capability_columns(capability), heading_rows(capability))
    return ["\n".join(capability_remarks(capability)), table]


def capability_picture(capability: Capability) -> Figure:
    """Returns the polar plot."""
    from finlab.display.pictures import polar_picture

    shown = shown_values(capability)
    values = shown.scale * capability.values
    curves = {case.name: values[c] for c, case in enumerate(capability.cases)}
    title = capability.layout
    if capability.notation is not None:
        numbers = ", ".join(str(number) for number in capability.notation)
        title = f"{capability.layout}: DP capability-L1({numbers})"
    worst = shown.scale * capability.worst if len(capability.cases) > 1 else None
    words = f"{shown.words} [{shown.unit}]" if shown.unit else shown.words
    marks = None
    if capability.buses:
        marks = (
            capability.binding_buses[0].any(axis=-1),
            capability.worst_binding_buses.any(axis=-1),
        )
    return polar_picture(title, words, capability.headings, curves, worst, marks)
