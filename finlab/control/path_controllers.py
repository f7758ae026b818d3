"""The controllers of paths, by name."""

from collections.abc import Callable

from finlab.control.controllers import WaypointController
from finlab.control.measurement import Controller
from finlab.control.tracking_controller import TrackingController
from finlab.layout import Layout

PATH_CONTROLLERS: dict[str, Callable[[Layout], Controller]] = {
    "tracking": TrackingController,
    "waypoint": lambda _: WaypointController(),
}
"""Name -> what makes the controller for the robot that is believed in; the default first."""
