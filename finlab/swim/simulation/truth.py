"""The robot that really swims, where its layout is not quite right, and what breaks on the way.

    ClosedLoop(layout, allocator, task, truth=perturbed(layout, damping=2.0))

Controllers, gains and allocators go on believing the layout; only the simulated body is another
one.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated, NamedTuple

import numpy as np
from msgspec import Meta

from finlab.arrays import Array
from finlab.axes import rotation
from finlab.errors import FinlabError, LayoutError
from finlab.files.schema import checked
from finlab.layout import Layout
from finlab.layout.damage import Damage, FaultKind
from finlab.swim.vehicle.fossen import complete_body
from finlab.swim.vehicle.vehicle import Vehicle

Factor = Annotated[float, Meta(gt=0.0, le=100.0)]


def perturbed(
    layout: Layout,
    *,
    damping: float = 1.0,
    added_mass: float = 1.0,
    inertia: float = 1.0,
    buoyancy: float = 1.0,
    askew: float = 0.0,
    center: Sequence[float] = (0.0, 0.0, 0.0),
) -> Layout:
    """A layout's robot with some numbers changed; what its body does not say is U-CAT's, as in any
    swim. Raises LayoutError: a factor is not above 0.

    Args:
        layout: what is believed.
        damping: factor of linear and quadratic damping.
        added_mass: factor of the added mass.
        inertia: factor of the moments of inertia; the mass stays, and with it the weight.
        buoyancy: factor of the buoyant force; 1.01 is a robot that rises.
        askew: how far actuators are turned about the vertical [rad], one this way and the next that
        way.
        center: the true centre of gravity as the layout's frame sees it (3,) [m]; the robot is
            ballasted to lie level all the same, so its centre of buoyancy is where the layout says,
            seen from there.
    """
    factors = {
        "damping": damping,
        "added_mass": added_mass,
        "inertia": inertia,
        "buoyancy": buoyancy,
    }
    for name, factor in factors.items():
        checked(factor, Factor, key=name)
    body = complete_body(layout)
    changed = replace(
        body,
        linear_damping=_scaled(body.linear_damping, damping),
        quadratic_damping=_scaled(body.quadratic_damping, damping),
        added_mass=_scaled(body.added_mass, added_mass),
        inertia_kgm2=_scaled(body.inertia_kgm2, inertia),
        buoyancy_n=buoyancy * Vehicle(body).buoyancy,
    )
    swum = replace(layout, body=changed)
    if askew == 0.0 and not any(center):
        return swum
    parts = []
    for k, part in enumerate(layout.actuators):
        turn = rotation((0.0, 0.0, 1.0), askew * (-1.0) ** k)
        parts.append(part.turned(np.array(part.frame) @ turn.T, np.subtract(part.position, center)))
    return replace(swum, actuators=tuple(parts))


def checked_truth(layout: Layout, truth: Layout) -> Layout:
    """The true robot; a `LayoutError` where it does not have the actuators of the layout that is
    believed."""
    if [(part.name, part.type) for part in truth.actuators] != [
        (p.name, p.type) for p in layout.actuators
    ]:
        known = ", ".join(layout.names)
        names = ", ".join(truth.names)
        raise LayoutError(f"truth: expected the actuators of {layout.name}, {known}, got {names}")
    return truth


def _scaled(values: Sequence[float] | None, factor: float) -> tuple[float, ...] | None:
    return None if values is None else tuple(factor * value for value in values)


KINDS: tuple[FaultKind, ...] = ("lost", "torn", "stuck", "whole")
"""What can become of an actuator in a swim: it hangs still; it gives a share of its thrust; it
beats but no longer turns; it works again as it should."""


class Fault(NamedTuple):
    """One event of a swim; `("front_left", 30.0)` is one that is lost."""

    name: str
    time_s: float
    """When [s]."""
    kind: FaultKind = "lost"
    share: float = 0.5
    """Share of the thrust that is left of a torn one, above 0 and below 1; of no meaning for the
    others."""

    @classmethod
    def parse(cls, kind: FaultKind, text: str) -> "Fault":
        """The event that an option of the command line says.

        Args:
            kind: what becomes of the actuator, which is the name of the option.
            text: `NAME@SECONDS`, or `NAME` for the start; of a torn one `NAME=SHARE@SECONDS` or
            `NAME=SHARE`.

        Raises:
            FinlabError: the text says something else, or the time or the share is out of range.
        """
        what, at, seconds = text.rpartition("@")
        if not at:
            what = text
            seconds = "0"
        name, equals, share = what.partition("=")
        example = "front_left=0.5@30" if kind == "torn" else "front_left@30"
        expected = "NAME=SHARE@SECONDS" if kind == "torn" else "NAME@SECONDS"
        wrong = FinlabError(f"{kind}: expected {expected} such as {example}, got {text!r:.60}")
        if not name or bool(equals) != (kind == "torn"):
            raise wrong
        try:
            time_s = float(seconds)
            left = float(share) if equals else 0.5
        except ValueError:
            raise wrong from None
        return cls(name, time_s, kind, left).checked()

    def checked(self) -> "Fault":
        """Itself; a `FinlabError` where a time, a kind or a share is none."""
        if not (math.isfinite(self.time_s) and self.time_s >= 0.0):
            raise FinlabError(
                f"fault of {self.name}: expected a time of 0 s or more, got {self.time_s}"
            )
        if self.kind not in KINDS:
            raise FinlabError(
                f"fault of {self.name}: expected {', '.join(KINDS)}, got {self.kind!r:.60}"
            )
        if not 0.0 < self.share < 1.0:
            raise FinlabError(
                f"fault of {self.name}: expected a share of the thrust between 0 and 1, got "
                f"{self.share}"
            )
        return self


def damage_of(layout: Layout, faults: Mapping[str, Fault], held: Array) -> Damage:
    """What faults, by name, leave of a robot; `held` (n,) is where actuators are stuck."""
    torn = {name: fault.share for name, fault in faults.items() if fault.kind == "torn"}
    stuck = {
        name: float(held[layout.index(name)])
        for name, fault in faults.items()
        if fault.kind == "stuck"
    }
    lost = [name for name, fault in faults.items() if fault.kind == "lost"]
    return Damage.representing(layout, lost, torn, stuck)
