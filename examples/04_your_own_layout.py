"""Describe a robot in Python, save it as a layout file, and allocate with it at once.

You will see the layout file of a robot with three fins and the command of each fin that lifts it.
"""

import math
from pathlib import Path
from tempfile import TemporaryDirectory

import finlab
from finlab.layout import Fin, Layout, Limits


def main() -> None:
    strong = Limits(amplitude=(0.05, 0.8), frequency=(0.1, 2.5))
    layout = Layout(
        name="tripod",
        description="One fin at the stern, two at the sides.",
        actuators=(
            Fin("stern", (-0.25, 0.0, 0.0), math.pi, strong),
            Fin("port", (0.1, 0.2, 0.0), math.radians(90)),
            Fin("starboard", (0.1, -0.2, 0.0), math.radians(-90)),
        ),
    )
    with TemporaryDirectory() as folder:
        path = Path(folder) / "tripod.yaml"
        finlab.save_layout(layout, path)
        print(path.read_text())
        layout = finlab.load_layout(path)
    result = finlab.Allocator(layout).allocate([0, 0, 2, 0, 0, 0])
    for name, (amplitude, frequency, direction) in zip(result.names, result.command, strict=True):
        print(f"{name:<10} A {amplitude:.3f} rad  f {frequency:.3f} Hz  zero direction {direction:+.3f} rad")
    print(f"heave delivered: {result.wrench[2]:.3f} N of 2 N")


if __name__ == "__main__":
    main()
