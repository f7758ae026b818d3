"""The plant: what a robot's fins really do, in float64. It judges every allocation method."""

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import Tensor

from finlab.errors import CommandError
from finlab.layout.arrays import stack_layouts
from finlab.layout.layout import Layout
from finlab.physics.fin_model import make_fin_model
from finlab.physics.wrench import body_force, effectiveness_matrix, wrench_of_forces


class Plant:
    """The analytic model of one layout, each fin with its own fin model."""

    def __init__(self, layout: Layout) -> None:
        """Prepares the fin models of `layout`.

        Raises:
            DataError: a fin's force table cannot be read.
        """
        self.layout = layout
        arrays = stack_layouts([layout])
        self._position = torch.from_numpy(arrays.position[0])
        self._mounting_angle = torch.from_numpy(arrays.mounting_angle[0])
        specs = [fin.model for fin in layout.fins]
        # Fins that share a model are evaluated together.
        self._groups = [
            (make_fin_model(spec), [i for i, other in enumerate(specs) if other == spec])
            for spec in dict.fromkeys(specs)
        ]

    def wrench(self, command: ArrayLike | Tensor) -> NDArray[np.float64]:
        """Returns the wrench that a command causes.

        Args:
            command: (..., n, 3) [rad, Hz, rad]; a row of NaN is a failed fin and gives no force.

        Returns:
            (..., 6) [N, N m], body frame.

        Raises:
            CommandError: the shape does not fit the layout, or a value is infinite or partly NaN.
        """
        force = torch.from_numpy(self.fin_forces(command))
        return np.asarray(wrench_of_forces(force, self._position).numpy())

    def fin_forces(self, command: ArrayLike | Tensor) -> NDArray[np.float64]:
        """Returns each fin's mean force (..., n, 3) [N] in the body frame; arguments as for `wrench`."""
        values, alive = self._checked(command)
        force = torch.zeros_like(values)
        with torch.no_grad():
            for model, members in self._groups:
                force[..., members, :] = model.force(values[..., members, :])
            force = torch.where(alive.unsqueeze(-1), body_force(force, self._mounting_angle), 0.0)
        return np.asarray(force.numpy())

    def effectiveness(self, command: ArrayLike | Tensor) -> NDArray[np.float64]:
        """Returns d wrench / d command (..., 6, n, 3) per rad, Hz, rad; a failed fin's columns are zero."""
        values, alive = self._checked(command)
        result = values.new_zeros((*values.shape[:-2], 6, *values.shape[-2:]))
        for model, members in self._groups:
            result[..., members, :] = effectiveness_matrix(
                model,
                values[..., members, :],
                self._position[members],
                self._mounting_angle[members],
                alive[..., members],
            )
        return np.asarray(result.numpy())

    def _checked(self, command: ArrayLike | Tensor) -> tuple[Tensor, Tensor]:
        """Returns finite float64 commands (..., n, 3) and which fins are alive (..., n)."""
        raw = command.detach().cpu().numpy() if isinstance(command, Tensor) else command
        try:
            values = np.array(raw, dtype=np.float64)
        except (TypeError, ValueError):
            raise CommandError(
                "expected commands as numbers [rad, Hz, rad] per fin, got something else"
            ) from None
        n_fins = self.layout.n_fins
        if values.ndim < 2 or values.shape[-2:] != (n_fins, 3):
            raise CommandError(
                f"expected commands (..., {n_fins}, 3) for layout {self.layout.name}, got {values.shape}"
            )
        failed = np.isnan(values).all(axis=-1)
        if not np.isfinite(values[~failed]).all():
            raise CommandError(
                f"the command for layout {self.layout.name} holds NaN or infinite values; "
                "a failed fin has NaN in all three entries, any other has none"
            )
        values[failed] = 0.0
        return torch.from_numpy(values), torch.from_numpy(~failed)
