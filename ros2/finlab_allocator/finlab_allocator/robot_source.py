"""The robot that parameter `robot` names."""

from finlab.allocation.allocator import Allocator
from finlab.bundle_files import is_bundle
from finlab.deploy.deployed_robot import DeployedRobot, load_robot
from finlab.errors import CommandError
from finlab.layout.load import layout_path, load_layout


def read_robot(robot: str) -> DeployedRobot:
    """Reads a robot.

    Args:
        robot: name of a shipped layout, path of a layout file, or of a bundle.

    Returns:
        The robot, by the method and settings of the bundle; of a layout by those of method `dual`.

    Raises:
        FinlabError: there is no such robot, or it cannot be read.
    """
    if not robot:
        raise CommandError(
            "robot: expected the name of a shipped layout, a layout file or a bundle, got none; "
            "start the node with -p robot:=NAME"
        )
    path = layout_path(robot)
    if is_bundle(path):
        return load_robot(path)
    return DeployedRobot(Allocator(load_layout(robot)))
