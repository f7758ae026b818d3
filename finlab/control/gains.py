"""Gains of the waypoint controller, for U-CAT's hull (layouts A to D, ucat)."""

from dataclasses import dataclass


@dataclass(frozen=True)
class WaypointGains:
    """Gains of the waypoint controller; as they stand here, with damping.

    Surge: a robot that holds speed v needs 28.5 v + 22 v^2 N, near 32 v at the paper's speeds. With the
    waypoint `lead_s` ahead of now, surge * lead_s = 32 balances that on the trajectory itself: no steady lag.
    Heave likewise: (30.6 + heave_damping) / heave = lead_s; with added mass the robot weighs 168 kg in heave,
    so the loop is at 0.5 rad/s with a damping ratio of one half. Yaw: the fins follow a new direction with a
    double pole of 3.5 rad/s, so the loop stays near 1 rad/s. No reported seed was looked at while choosing.
    """

    period_s: float = 0.1
    """Time between calls [s]."""
    lead_s: float = 2.0
    """How far ahead of now the waypoint runs on the trajectory [s]."""
    surge: float = 16.0
    """Fx per metre of horizontal distance [N/m]."""
    heave: float = 42.0
    """Fz per metre of height [N/m]."""
    heave_damping: float = 54.0
    """Fz against the speed of climbing [N s/m]; 0 is the paper's law."""
    climb_filter_s: float = 0.5
    """Time constant of the filter of the speed that is damped [s]."""
    odometry_filter_s: float = 1.5
    """Time constant with which markers and pressure correct the odometry [s]."""
    yaw: float = 3.0
    """Tz per radian of heading error [N m/rad]."""
    yaw_damping: float = 4.0
    """Tz against the yaw rate [N m s/rad]; 0 is the paper's law."""
    near_m: float = 0.15
    """Within this distance of the waypoint the heading counts in proportion to it [m]; right above the
    waypoint there is none to steer to."""
    max_surge: float = 10.0
    """Largest Fx [N]."""
    max_heave: float = 8.0
    """Largest Fz [N]."""
    max_yaw: float = 1.5
    """Largest Tz [N m]."""


PAPER_WAYPOINT_GAINS = WaypointGains(
    lead_s=5.0, surge=6.4, heave=8.0, heave_damping=0.0, yaw=0.3, yaw_damping=0.0
)
"""The paper's law: proportional terms alone. The paper prints no gains; these have a longer lead and a softer
heading, since only the water damps the heading."""
