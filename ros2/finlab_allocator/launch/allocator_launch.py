"""Starts the node with a file of parameters, and a robot in place of the file's:
`ros2 launch finlab_allocator allocator_launch.py robot:=my_robot`."""

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

PACKAGE = "finlab_allocator"


def generate_launch_description() -> LaunchDescription:
    """Returns what `ros2 launch` starts."""
    parameters = f"{get_package_share_directory(PACKAGE)}/config/allocator.yaml"
    arguments = [
        DeclareLaunchArgument(
            "robot",
            default_value="bluerov2_heavy",
            description="name of a shipped layout, a layout file, or a bundle",
        ),
        DeclareLaunchArgument(
            "parameters", default_value=parameters, description="file of parameters"
        ),
        DeclareLaunchArgument("namespace", default_value="", description="of node and topics"),
    ]
    node = Node(
        package=PACKAGE,
        executable=PACKAGE,
        name=PACKAGE,
        namespace=LaunchConfiguration("namespace"),
        parameters=[LaunchConfiguration("parameters"), {"robot": LaunchConfiguration("robot")}],
        output="screen",
    )
    return LaunchDescription([*arguments, node])
