"""Parameters of the ROS 2 node of package finlab_allocator for one robot, as a YAML file that a
launch file or `--params-file` takes."""

from collections.abc import Sequence

from finlab.allocation.policy import POLICY_NAMES, PolicyName
from finlab.errors import CommandError
from finlab.files import yaml_text

HEAD = (
    "# Parameters of node finlab_allocator: ros2 run finlab_allocator finlab_allocator --ros-args "
    "--params-file THIS_FILE\n"
    "# What is left out keeps its default; `ros2 param describe /finlab_allocator NAME` says what "
    "each is.\n"
)
"""Comment at the top of the file."""


def ros_parameters(robot: str, policy: PolicyName = "closest", lost: Sequence[str] = ()) -> str:
    """Returns the node's parameters for a robot as YAML.

    Args:
        robot: name of a shipped layout, or of a layout file or bundle, which the node opens from
            the folder where it is started.
        policy: what to give for a wrench out of reach.
        lost: names of actuators that do not work.

    Raises:
        CommandError: there is no such policy.
    """
    if policy not in POLICY_NAMES:
        raise CommandError(f"policy: expected one of {', '.join(POLICY_NAMES)}, got {policy!r}")
    values: dict[str, object] = {"robot": robot, "policy": policy}
    if lost:  # ROS takes no empty list for one of texts
        values["lost"] = list(lost)
    return HEAD + yaml_text({"/**": {"ros__parameters": values}})
