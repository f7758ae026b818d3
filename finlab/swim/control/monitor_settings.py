"""Settings of a fault monitor: what it assumes of a robot, its sensors and its faults."""

from dataclasses import dataclass


@dataclass(frozen=True)
class MonitorSettings:
    """What a `FaultMonitor` takes for granted. Standard deviations, and rates per second."""

    rate_noise: float = 0.01
    """Of a measured angular rate [rad/s]."""
    velocity_noise: float = 0.012
    """Of a measured velocity [m/s]."""
    tilt_noise: float = 0.012
    """Of measured roll and pitch [rad]."""
    depth_noise: float = 0.01
    """Of a measured depth [m]."""
    acceleration_noise: float = 0.1
    """Of a measured specific force [m/s^2]."""
    acceleration_bias: float = 0.08
    """Of what an accelerometer shows too much, that of a tilt which is off by a little included
    [m/s^2]."""
    acceleration_bias_drift: float = 0.001
    """Of its change [m/s^2], per root of a second."""
    term_share: float = 0.01
    """Share by which each term of the equation of motion is off, for about a second."""
    lag_s: float = 0.02
    """Of an actuator's time constant [s]."""
    disturbance: float = 0.001
    """Of an acceleration that nothing explains [m/s^2], per root of a second."""
    unknown: float = 0.05
    """Of an acceleration that stays, as by buoyancy and trim [m/s^2]."""
    unknown_drift: float = 0.001
    """Of its change [m/s^2], per root of a second."""
    current: float = 0.1
    """Of the current that is expected [m/s]; a fifth of it vertically."""
    current_drift: float = 0.003
    """Of its change [m/s], per root of a second."""
    inertia: float = 0.13
    """Of mass and moments, with those of the water, as a share of the layout's."""
    coupling: float = 0.04
    """Of the entries of the inertia matrix beside its diagonal, over the geometric mean of the two
    diagonal ones."""
    damping: float = 0.15
    """Of damping and righting moment, as a share."""
    body_drift: float = 0.005
    """Of the change of these shares, per root of a second."""
    strength: float = 0.04
    """Of the strength of a whole actuator."""
    strength_drift: float = 0.002
    """Of its change, per root of a second."""
    place: float = 0.0035
    """Of the point at which an actuator pushes, beside that of the layout, along each axis [m]."""
    failures: float = 5e-4
    """Events per actuator and second that are expected."""
    jolt: float = 0.2
    """Of an acceleration that begins at some moment and that no fault explains, such as the pull
    of a tether [m/s^2]."""
    jolts: float = 2e-5
    """How many are expected per second."""
    settle_s: float = 6.0
    """Time at the start in which current and trim are learnt and little is suspected [s]."""
    probe_every_s: float = 20.0
    """Time after which an actuator that is taken for lost is tried again [s]; 0 for never."""
    least_push: float = 0.5
    """Force [N] that every fin gives at least, up or down where it would rest, so that its loss
    shows; 0 for none. Costs power, where fins would rest."""
    threshold: float = 0.93
    """Probability of a fault from which it is acted on, if it holds for a while."""
