"""What a `FaultMonitor` takes for granted: noise, drift, and how often fins break."""

from dataclasses import dataclass


@dataclass(frozen=True)
class MonitorSettings:
    """What the monitor takes for granted. Standard deviations, and rates per second."""

    rate_noise: float = 0.01
    """Of a measured angular rate [rad/s]."""
    velocity_noise: float = 0.01
    """Of a measured velocity [m/s]."""
    tilt_noise: float = 0.01
    """Of measured roll and pitch [rad]."""
    force_noise: float = 0.05
    """Of a force that the model does not know [N], per root of a second."""
    torque_noise: float = 0.005
    """Of such a torque [N m], per root of a second."""
    current: float = 0.05
    """Of the current that is expected [m/s]."""
    current_drift: float = 0.002
    """Of its change [m/s], per root of a second."""
    rising_current: float = 0.01
    """The same of a current that rises or sinks [m/s]; its drift is as much smaller."""
    torque: float = 0.1
    """Of a torque that stays [N m]; what a tilt sensor that sits askew makes of the hull's weight is one."""
    torque_drift: float = 0.003
    """Of its change [N m], per root of a second."""
    strength: float = 0.05
    """Of the strength of a whole or a lost fin, and the most that is ever unknown of one that rests."""
    new_strength: float = 0.25
    """The same of a fin that has just been torn."""
    strength_drift: float = 0.005
    """Of its change, per root of a second."""
    failures: float = 1e-5
    """Events per fin and second that are expected."""
    doubt_s: float = 20.0
    """Time after which a suspicion that nothing feeds is given up [s]."""
    settle_s: float = 6.0
    """Time at the start in which current and trim are learnt and nothing is suspected [s]."""
    probe_every_s: float = 20.0
    """Time after which a fin that is taken for lost is tried again [s]; 0 for never."""
    least_push: float = 0.5
    """Force [N] that every fin gives at least, up or down where it would rest, so that its loss shows; 0 for
    none. Costs power, where fins would rest."""
    threshold: float = 0.97
    """Probability of a fin's failure from which it is acted on, if it holds for two tenths of a second."""
