"""`finlab fit robot`: fits a robot's actuators and body to swims."""

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from finlab.cli.shared_options import Robot, open_robot, tell


def robot(
    layout: Robot,
    logs: Annotated[Positional[tuple[Path, ...]], arg(metavar="LOG...")],
    output: Annotated[Path, arg(metavar="LAYOUT2", aliases=["-o"])],
    other_law: bool = True,
) -> None:
    """Learn a robot from swims: its actuators' strengths and directions, and its body.

    A log is log.npz of `finlab simulate`, or a CSV file: t, what was measured (x, y, z, roll,
    pitch, yaw, u, v, w, p, q, r), and what was commanded: NAME.A, NAME.f, NAME.phi of a fin,
    NAME.force of a thruster, NAME.angle and NAME.force of an azimuth, NAME.deflection of a rudder.
    `finlab simulate --excite` makes a swim that determines much.

    Args:
        layout: the robot as it is believed to be: layout file or the name of a shipped layout.
        logs: swims of that robot.
        output: the layout as the swims show it; fins whose law is another one become tables beside
            it.
        other_law: of robots of fins look for another law of thrust, too, and use it where it helps
            on parts not seen.
    """
    from finlab.errors import DataError
    from finlab.files.worker import in_worker
    from finlab.swim.identification.fitted_robot import summary, table, write_robot
    from finlab.swim.identification.robot_fit import fit_robot
    from finlab.swim.identification.swim import read_swim

    if output.suffix.lower() not in (".yaml", ".yml", ".json"):
        raise DataError(
            f"{output}: a layout is a YAML or JSON file, expected a name that ends in .yaml or "
            ".json"
        )
    believed = open_robot(layout)[0]
    swims = [in_worker(read_swim, log, believed) for log in logs]
    fit = fit_robot(believed, swims, other_law, tell)
    write_robot(fit, output)
    print("\n".join(summary(fit)))
    print()
    print(table(fit))
    print(f"\n{output}: the robot as it swam")
