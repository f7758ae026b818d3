"""Integrators of the bodies of simulated robots, by name."""

from collections.abc import Sequence
from pkgutil import resolve_name

from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.swim.vehicle.body_integrator import BodyIntegrator

PLANTS: dict[str, str] = {
    "finlab": "finlab.swim.vehicle.vehicle:vehicle_of",
    "mujoco": "finlab.swim.vehicle.mujoco_body:MujocoBody",
}
"""Name -> where what makes it stands, `module:callable` of a layout and a current; it is imported
when it is asked for."""


def body_integrator(plant: str, layout: Layout, current: Sequence[float]) -> BodyIntegrator:
    """Makes what integrates a robot's body.

    Args:
        plant: a name in `PLANTS`.
        layout: the robot; what its body does not say is U-CAT's.
        current: velocity (3,) of the water in the world [m/s].

    Raises:
        FinlabError: there is no such plant, or the current is no velocity.
    """
    if plant not in PLANTS:
        raise FinlabError(f"plant: expected one of {', '.join(PLANTS)}, got {plant!r:.60}")
    made: BodyIntegrator = resolve_name(PLANTS[plant])(layout, current)
    return made
