"""Forces of fins to the wrench on the body, for padded batches.

Frames: fin frame x' = shaft, y' = e_h, z' = e_z (see `finlab.layout.fin`); body frame FLU about the centre of
gravity. Wrench order [Fx, Fy, Fz, Tx, Ty, Tz] in N and N m.
"""

import torch
from torch import Tensor

from finlab.physics.fin_model import FinModel


def body_force(fin_force: Tensor, mounting_angle: Tensor) -> Tensor:
    """Turns forces from the fin frame to the body frame.

    Args:
        fin_force: (..., 3) along (x', y', z') [N].
        mounting_angle: (...) [rad].

    Returns:
        (..., 3) along body (x, y, z) [N].
    """
    cos, sin = torch.cos(mounting_angle), torch.sin(mounting_angle)
    shaft, horizontal, vertical = fin_force.unbind(dim=-1)
    return torch.stack([shaft * cos - horizontal * sin, shaft * sin + horizontal * cos, vertical], dim=-1)


def wrench_of_forces(force: Tensor, position: Tensor) -> Tensor:
    """Sums body-frame forces (..., n, 3) [N] at positions (..., n, 3) [m] to the wrench (..., 6)."""
    x, y, z = position.unbind(dim=-1)
    fx, fy, fz = force.unbind(dim=-1)
    # Written out because torch.linalg.cross is several times slower on the small last axis.
    rows = [fx, fy, fz, y * fz - z * fy, z * fx - x * fz, x * fy - y * fx]
    return torch.stack([row.sum(dim=-1) for row in rows], dim=-1)


def masked_force(model: FinModel, command: Tensor, mask: Tensor | None) -> Tensor:
    """Returns fin-frame forces (..., n, 3) [N], exactly zero with zero gradient where mask (..., n) is False.

    The command is replaced before the model sees it: whatever padding holds, NaN included, never leaks.
    """
    if mask is None:
        return model.force(command)
    keep = mask.unsqueeze(-1)
    force = model.force(torch.where(keep, command, torch.zeros_like(command)))
    return torch.where(keep, force, torch.zeros_like(force))


def assemble_wrench(
    model: FinModel, command: Tensor, position: Tensor, mounting_angle: Tensor, mask: Tensor | None = None
) -> Tensor:
    """Returns the wrench that commands cause.

    Args:
        model: the fin model that all fins follow.
        command: (..., n, 3) [rad, Hz, rad].
        position: (..., n, 3), body frame [m].
        mounting_angle: (..., n) [rad].
        mask: (..., n), False for padding and lost fins; None when all fins are there.

    Returns:
        (..., 6) [N, N m].
    """
    force = body_force(masked_force(model, command, mask), mounting_angle)
    return wrench_of_forces(force, position)


def effectiveness_matrix(
    model: FinModel, command: Tensor, position: Tensor, mounting_angle: Tensor, mask: Tensor | None = None
) -> Tensor:
    """Returns how the wrench changes with each command, d wrench / d command.

    A fin's force depends on its own command alone, so three backward passes serve any number of fins.

    Args:
        model: the fin model that all fins follow.
        command: (..., n, 3) [rad, Hz, rad].
        position: (..., n, 3), body frame [m].
        mounting_angle: (..., n) [rad].
        mask: (..., n), False for padding and lost fins, whose columns are zero.

    Returns:
        (..., 6, n, 3), per rad, Hz and rad; detached from the graph.
    """
    with torch.enable_grad():
        variable = command.detach().requires_grad_(True)
        force = body_force(masked_force(model, variable, mask), mounting_angle.detach())
        rows = [
            torch.autograd.grad(force[..., axis].sum(), variable, retain_graph=axis < 2)[0]
            for axis in range(3)
        ]
    jacobian = torch.stack(rows, dim=-3)  # (..., 3 force axes, n, 3 command entries)
    columns = jacobian.movedim(-3, -1)  # (..., n, 3 command entries, 3 force axes)
    moment = torch.linalg.cross(position.detach().unsqueeze(-2).expand_as(columns), columns)
    return torch.cat([columns, moment], dim=-1).movedim(-1, -3)
