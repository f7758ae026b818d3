"""Forces of fins to the wrench on the body, for numpy's arrays and torch's tensors.

Frames: fin frame x' = shaft, y' = e_h, z' = e_z (see `finlab.layout.fin`); body frame FLU about the centre of
gravity. Wrench order [Fx, Fy, Fz, Tx, Ty, Tz] in N and N m.
"""

from finlab.arrays import Values


def body_force(own_force: Values, frames: Values) -> Values:
    """Turns forces from the actuators' own frames to the body frame.

    Args:
        own_force: (..., 3) along own axes [N].
        frames: (..., 3, 3), own axes in the rows, such as `layout.frames`.

    Returns:
        (..., 3) along body (x, y, z) [N].
    """
    return (own_force[..., None, :] @ frames)[..., 0, :]


def wrench_of_forces(fin_force: Values, effectiveness: Values) -> Values:
    """Sums forces (..., n, 3) [N] in fin frames to wrenches (..., 6) [N, N m].

    Args:
        fin_force: broadcast with the effectiveness.
        effectiveness: wrench per newton of each fin (..., n, 3, 6), from `force_effectiveness` of
            `finlab.layout.arrays`.
    """
    n = fin_force.shape[-2]
    flat = effectiveness.reshape(*effectiveness.shape[:-3], 3 * n, 6)
    if flat.ndim == 2:
        return fin_force.reshape(*fin_force.shape[:-2], 3 * n) @ flat
    row = fin_force.reshape(*fin_force.shape[:-2], 1, 3 * n)
    return (row @ flat)[..., 0, :]
