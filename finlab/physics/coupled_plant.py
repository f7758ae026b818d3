"""The plant of a layout whose fins take something from each other: see `finlab.layout.interaction`."""

from types import SimpleNamespace

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
        alone = super().force(command, flow=flow)
        return alone * self.coupling.kept(alone, command, self.inflow(flow))[..., None]

    def force_and_jacobian(self, command: Array, *, flow: Array | None = None) -> tuple[Array, Array]:
        """See `Plant`; the derivatives of each force by its own command, the others unchanged."""
        alone, jacobian, kept, by_command = self._alone_and_kept(command, flow)
        n = np.arange(self.n)
        own = np.moveaxis(by_command[..., n, :, n], 0, -2)
        jacobian = jacobian * kept[..., None, None] + own[..., None] * alone[..., None, :]
        return alone * kept[..., None], jacobian

    def _alone_and_kept(self, command: Array, flow: Array | None) -> tuple[Array, ...]:
        """Forces (..., n, 3) of fins alone and what they keep (..., n), each followed by its derivatives."""
        alone, jacobian = super().force_and_jacobian(command, flow=flow)
        kept = self.coupling.kept_and_jacobian(alone, jacobian, command, self.inflow(flow))
        return alone, jacobian, *kept

    @property
    def parts(self) -> tuple[SimpleNamespace, Array]:
        """See `Plant`; each actuator's part in all six axes of the wrench, since its command changes the
        parts of the others, too."""
        given = SimpleNamespace(force=self._shares, force_and_jacobian=self.shares_and_jacobian)
        return given, np.broadcast_to(np.eye(6), (self.n, 6, 6))

    def _shares(self, command: Array) -> Array:
        """Each actuator's part of the wrench (..., n, 6) of commands (..., n, 3)."""
        parts: Array = np.einsum("...na,nab->...nb", self.force(command), self.effectiveness)
        return parts

    def linearize(self, command: Array, *, flow: Array | None = None) -> tuple[Array, Array]:
        """See `Plant`."""
        shares, jacobian = self.shares_and_jacobian(command, flow=flow)
        jacobian = jacobian.reshape(*shares.shape[:-2], 3 * self.n, 6)
        return shares.sum(axis=-2), jacobian.swapaxes(-1, -2)

    def shares_and_jacobian(self, command: Array, *, flow: Array | None = None) -> tuple[Array, Array]:
        """Each actuator's part of the wrench (..., n, 6), and the derivatives of the whole wrench by each
        command of each actuator (..., n, 3, 6)."""
        alone, own, kept, by_command = self._alone_and_kept(command, flow)
        by_alone = np.einsum("...na,nab->...nb", alone, self.effectiveness)
        jacobian = (own @ self.effectiveness) * kept[..., None, None]
        jacobian = jacobian + by_command @ by_alone[..., None, :, :]
        return by_alone * kept[..., None], jacobian
