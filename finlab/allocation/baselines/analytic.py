"""Methods `analytic` and `fixed_frequency`: pseudo-inverse of the forces, each turned into a command."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from finlab.allocation.baselines.model_based import ModelBased
from finlab.allocation.baselines.pseudo_inverse import PseudoInverse
from finlab.allocation.settings import Settings, number
from finlab.arrays import Array
from finlab.physics import plant_of


class Analytic(ModelBased):
    """Pseudo-inverse of the forces, rows scaled by sigma and columns by each actuator's largest force, which
    each gives by its cheapest command. What does not fit is clipped, the rest not redistributed."""

    name = "analytic"
    takes = "any actuator"

    def _commands(self, targets: Array, seed: int) -> Array:
        return self._inverse.command(targets)


@dataclass(frozen=True)
class FixedFrequencySettings(Settings):
    """Settings of method `fixed_frequency`."""

    frequency: float = number(
        2.1, 0.01, 100.0, "at which all fins beat, within the limits of each; U-CAT's are 1.1 and 2.1", "Hz"
    )


class FixedFrequency(ModelBased):
    """U-CAT's on-board law: all fins beat at one frequency; force sets the amplitude, its direction the zero
    direction.

    With the law `drag` of a fin, `A = 1/2 arccos(1 - F / (2 rho Cd S rc^2 (2 pi f)^2))`; other laws are
    inverted in the same way. Where a fin is asked for more than it can give, all forces are scaled down
    together, as on board all amplitudes are. A fin of less force than that of its least amplitude stops: it
    takes its least amplitude and frequency. Forces are those of the pseudo-inverse, which on U-CAT's layout
    replaces the on-board rules made for it.
    """

    name = "fixed_frequency"
    settings_class = FixedFrequencySettings
    settings: FixedFrequencySettings

    @cached_property
    def _inverse(self) -> PseudoInverse:
        layout, fins = self.layout, []
        for fin in layout.fins:
            (low, high), wanted = fin.limits.frequency, self.settings.frequency
            held = min(max(wanted, low), high)
            fins.append(replace(fin, limits=replace(fin.limits, frequency=(held, held))))
        plant = plant_of(replace(layout, actuators=tuple(fins))).counting(layout.commanded)
        return PseudoInverse(plant.at(self.plant.flow), self.sigma)

    def _commands(self, targets: Array, seed: int) -> Array:
        inverse, lower = self._inverse, self.plant.lower
        force = inverse.force(targets)
        share = np.linalg.norm(force, axis=-1) / np.maximum(inverse.largest, 1e-9)
        force /= np.maximum(share.max(axis=1), 1.0)[:, None, None]
        command = inverse.decoded(force)
        least = command.copy()
        least[..., 0] = lower[:, 0]
        stops = np.linalg.norm(force, axis=-1) < np.linalg.norm(inverse.plant.force(least), axis=-1)
        command[..., :2] = np.where(stops[..., None], lower[:, :2], command[..., :2])
        return command
