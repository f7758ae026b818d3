"""The plant of a layout whose fins take something from each other: see `finlab.layout.interaction`."""

import numpy as np

from finlab.arrays import Array
from finlab.layout.layout import Layout
from finlab.physics.coupling import Coupling
from finlab.physics.plant import Plant


class CoupledPlant(Plant):
    """A `Plant` in which the force of each fin depends on the commands of all."""

    def __init__(self, layout: Layout) -> None:
        super().__init__(layout)
        assert layout.interaction is not None
        self.coupling = Coupling(layout, layout.interaction, self.effectiveness, self.blade.length)
        self.feels_flow |= layout.has_inflow

    def force(self, command: Array, *, flow: Array | None = None) -> Array:
        """See `Plant`."""
        inflow = self.inflow(flow)
        alone = self._force(command, inflow)
        return alone * self.coupling.kept(alone, command, inflow)[..., None]

    def force_and_jacobian(self, command: Array, *, flow: Array | None = None) -> tuple[Array, Array]:
        """See `Plant`; the derivatives of each force by its own command, the others unchanged."""
        inflow = self.inflow(flow)
        alone, jacobian = self._force_and_jacobian(command, inflow)
        kept, by_command = self.coupling.kept_and_jacobian(alone, jacobian, command, inflow)
        n = np.arange(self.n)
        own = np.moveaxis(by_command[..., n, :, n], 0, -2)
        jacobian = jacobian * kept[..., None, None] + own[..., None] * alone[..., None, :]
        return alone * kept[..., None], jacobian

    @property
    def parts(self) -> tuple["WrenchParts", Array]:
        """See `Plant`; each actuator's part in all six axes of the wrench, since its command changes the
        parts of the others, too."""
        return WrenchParts(self), np.broadcast_to(np.eye(6), (self.n, 6, 6))

    def linearize(self, command: Array, *, flow: Array | None = None) -> tuple[Array, Array]:
        """See `Plant`."""
        shares, jacobian = self.shares_and_jacobian(command, flow=flow)
        jacobian = jacobian.reshape(*shares.shape[:-2], 3 * self.n, 6)
        return shares.sum(axis=-2), jacobian.swapaxes(-1, -2)

    def shares_and_jacobian(self, command: Array, *, flow: Array | None = None) -> tuple[Array, Array]:
        """Each actuator's part of the wrench (..., n, 6), and the derivatives of the whole wrench by each
        command of each actuator (..., n, 3, 6)."""
        inflow = self.inflow(flow)
        alone, own = self._force_and_jacobian(command, inflow)
        kept, by_command = self.coupling.kept_and_jacobian(alone, own, command, inflow)
        by_alone = np.einsum("...na,nab->...nb", alone, self.effectiveness)
        jacobian = (own @ self.effectiveness) * kept[..., None, None]
        jacobian = jacobian + by_command @ by_alone[..., None, :, :]
        return by_alone * kept[..., None], jacobian


class WrenchParts:
    """A coupled plant as the refinement of commands sees it: parts of a wrench in place of forces of fins."""

    def __init__(self, plant: CoupledPlant) -> None:
        self._plant = plant

    def force(self, command: Array) -> Array:
        """Each actuator's part of the wrench (..., n, 6) of commands (..., n, 3)."""
        parts: Array = np.einsum("...na,nab->...nb", self._plant.force(command), self._plant.effectiveness)
        return parts

    def force_and_jacobian(self, command: Array) -> tuple[Array, Array]:
        """See `CoupledPlant.shares_and_jacobian`."""
        return self._plant.shares_and_jacobian(command)
