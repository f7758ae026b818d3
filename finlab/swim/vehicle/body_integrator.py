"""The interface of what moves a simulated robot through the water, as a closed loop knows it;
`plants.py` has those that there are, by name."""

from typing import NamedTuple, Protocol

from finlab.arrays import Array


class ActuatorLoad(NamedTuple):
    """What n actuators give a body in K steps."""

    wrench: Array
    """Wrenches (K, 6) of all of them, with what they do to each other [N, N m], body frame."""
    force: Array
    """Forces (K, n, 3) along own axes [N]."""
    others: Array
    """Commands (K, n - n_fins, 3) that those which are no fins followed."""


class BodyIntegrator(Protocol):
    """Integrates the motion of one robot's body.

    States (13,) are position in the world [m], quaternion (w, x, y, z), velocity over ground [m/s]
    and angular rates [rad/s] in the body frame.
    """

    @property
    def current(self) -> tuple[float, ...]:
        """Velocity of the water (3,) in the world [m/s]."""

    def velocity_in_water(self, state: Array) -> Array:
        """Returns the velocity relative to the water and the angular rates (6,) of a state, body
        frame [m/s, rad/s]."""

    def advance(self, state: Array, load: ActuatorLoad, dt: float) -> Array:
        """Returns the states (K, 13) after each of K periods.

        Args:
            state: at the beginning.
            load: what the actuators give in each period, which the body carries along.
            dt: a period [s].

        Raises:
            LayoutError: the body moves too fast to be simulated.
        """
