"""A method in another program, in any language: questions on stdin, answers on stdout, in lines of JSON.

You will see the pseudo-inverse, written out for fins of the law `drag`, on the paper's layout A.
"""

import json
import shlex
import sys
from typing import Any

import numpy as np

from finlab.cli import main

THRUST = 4.737
"""Of U-CAT's fins: T = 4.737 f^2 sin^2(A) N; the layouts A to D have no others."""


def commands(layout: dict[str, Any], targets: list[list[float]]) -> list[Any]:
    """One [A, f, phi] per fin for each target."""
    columns, largest = [], []
    for fin in layout["fins"]:
        angle, limits = np.radians(fin["mounting_angle_deg"]), fin["limits"]
        for axis in ([-np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]):
            columns.append([*axis, *np.cross(fin["position_m"], axis)])
        largest.append([limits["amplitude_rad"][1], *limits["frequency_hz"]])
    force = (np.array(targets) @ np.linalg.pinv(np.array(columns))).reshape(len(targets), -1, 2)
    amplitude, least, most = np.array(largest).T
    frequency = np.sqrt(np.linalg.norm(force, axis=-1) / THRUST) / np.sin(amplitude)
    direction = np.arctan2(force[..., 1], force[..., 0])
    values = [np.broadcast_to(amplitude, frequency.shape), np.clip(frequency, least, most), direction]
    return list(np.stack(values, axis=-1).tolist())


if __name__ == "__main__":
    if "--answer" in sys.argv:
        for line in sys.stdin:
            asked = json.loads(line)
            answer = {"id": asked["id"], "commands": commands(asked["layout"], asked["targets"])}
            print(json.dumps(answer), flush=True)
    else:
        program = shlex.join([sys.executable, __file__, "--answer"])
        main(["bench", "--command", program, "--quick", "--sets", "paper"])
