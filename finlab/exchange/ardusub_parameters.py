"""Parameters of ArduSub: which of its frames a robot has, and which motors its wiring reverses."""

import re

from finlab.errors import LayoutError
from finlab.exchange.ardusub import of_factors
from finlab.exchange.ardusub_frames import FRAMES
from finlab.exchange.exchange import Exchange
from finlab.exchange.parameters import read_parameters
from finlab.layout import Layout

CONFIGURED = (
    "BLUEROV1 VECTORED VECTORED_6DOF VECTORED_6DOF_90DEG SIMPLEROV_3 SIMPLEROV_4 SIMPLEROV_5".split()  # noqa: SIM905
)
"""Frames by FRAME_CONFIG; 7 is a frame of one's own, in the firmware or a script."""
OF_ARDUPILOT = re.compile(r"^[ \t\d]{0,20}(?:FRAME_C(?:ONFIG|LASS)|MOT_\w+|SYSID_THISMAV)\b", re.MULTILINE)
"""A line by which parameters of ArduPilot are known."""


def read_ardusub_parameters(text: str, name: str, exchange: Exchange) -> Layout:
    """Returns the layout, called `name`, of the frame in a list of parameters.

    MOT_n_DIRECTION -1 turns a motor the other way for the same output, so that it pushes as its frame says.

    Raises:
        LayoutError: FRAME_CONFIG is not in it, or names a frame of one's own; a value is no number.
    """
    values = read_parameters(text, "FRAME_ MOT_1 MOT_2 MOT_3 MOT_4 MOT_5 MOT_6 MOT_7 MOT_8")
    config = values.get("FRAME_CONFIG")
    if config is None:
        other = " of another vehicle (FRAME_CLASS)" if "FRAME_CLASS" in values else ""
        raise LayoutError(
            f"holds {len(values)} parameters of ArduPilot{other}, but no FRAME_CONFIG, by which ArduSub "
            "names the motors of a robot"
        )
    if config not in range(len(CONFIGURED)):
        raise LayoutError(
            f"is {config:g}, a frame of one's own, which parameters do not hold; give the script (.lua) or "
            f"source with its motors; finlab knows 0 to 6: {', '.join(CONFIGURED)}",
            "FRAME_CONFIG",
        )
    frame = CONFIGURED[int(config)]
    exchange.note(f"FRAME_CONFIG {config:g} was read: ArduSub's frame {frame}.")
    n, turned = len(FRAMES[frame]), []
    for i in range(1, n + 1):
        sign = values.get(f"MOT_{i}_DIRECTION", 1.0)
        if abs(sign) != 1.0:
            raise LayoutError(f"is {sign:g}, expected 1 or -1", f"MOT_{i}_DIRECTION")
        turned += [str(i)] if sign < 0 else []
    if turned:
        exchange.note(
            f"MOT_n_DIRECTION reverses the outputs of motors {', '.join(turned)}, so that they push as the "
            "frame says: forces of the layout are those of the frame."
        )
    return of_factors(name, [f"motor{i}" for i in range(1, n + 1)], FRAMES[frame], exchange)
