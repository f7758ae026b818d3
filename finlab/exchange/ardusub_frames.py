"""The frames that ArduSub knows: motor factors, rows of roll, pitch, yaw, throttle, forward and lateral.

Signs are those of ArduSub: forward, right and up are positive, and so are roll to the right, pitch up and yaw
clockwise seen from above (ArduSub, `AP_Motors6DOF::setup_motors`, commit of 2026).
"""

import numpy as np

from finlab.arrays import Array

AXES = ("Tx", "Ty", "Tz", "Fz", "Fx", "Fy")
"""Axis of the body frame (x forward, y left, z up) for each column."""
SIGNS = np.array([1.0, -1.0, -1.0, 1.0, 1.0, -1.0])
"""Sign of that axis for a positive factor."""
_PLANAR = ((0, 0, 1, 0, -1, 1), (0, 0, -1, 0, -1, -1), (0, 0, -1, 0, 1, 1), (0, 0, 1, 0, 1, -1))
_SIMPLE = ((0, 0, -1, 0, 1, 0), (0, 0, 1, 0, 1, 0))
_TWO = ((1, 0, 0, -1, 0, 0), (-1, 0, 0, -1, 0, 0))
FRAMES: dict[str, Array] = {
    name: np.array(rows, np.float64)
    for name, rows in {
        "BLUEROV1": (
            *((0, 0, -1, 0, 1, 0), (0, 0, 1, 0, 1, 0), (-0.5, 0.5, 0, 0.45, 0, 0)),
            *((0.5, 0.5, 0, 0.45, 0, 0), (0, -1, 0, 1, 0, 0), (-0.25, 0, 0, 0, 0, 1)),
        ),
        "VECTORED": (*_PLANAR, *_TWO),
        "VECTORED_6DOF": (
            *_PLANAR,
            *((1, -1, 0, -1, 0, 0), (-1, -1, 0, -1, 0, 0), (1, 1, 0, -1, 0, 0), (-1, 1, 0, -1, 0, 0)),
        ),
        "VECTORED_6DOF_90DEG": (
            *((1, 1, 0, 1, 0, 0), (0, 0, 1, 0, 1, 0), (1, -1, 0, 1, 0, 0), (0, 0, 0, 0, 0, 1)),
            *((0, 0, 0, 0, 0, 1), (-1, 1, 0, 1, 0, 0), (0, 0, -1, 0, 1, 0), (-1, -1, 0, 1, 0, 0)),
        ),
        "SIMPLEROV_3": (*_SIMPLE, (0, 0, 0, -1, 0, 0)),
        "SIMPLEROV_4": (*_SIMPLE, *_TWO),
        "SIMPLEROV_5": (*_SIMPLE, *_TWO, (0, 0, 0, 0, 0, 1)),
    }.items()
}
"""Name of a frame -> factors (n, 6), in the order of FRAME_CONFIG."""
