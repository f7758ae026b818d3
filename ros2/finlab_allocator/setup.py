"""What colcon installs; ros2 run and ros2 launch find it by the index of ament."""

from setuptools import setup

NAME = "finlab_allocator"

setup(
    name=NAME,
    version="0.1.0",
    description="Control allocation for underwater robots, as a ROS 2 node",
    license="Apache-2.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml", "README.md"]),
        (f"share/{NAME}/launch", ["launch/allocator_launch.py"]),
        (f"share/{NAME}/config", ["config/allocator.yaml"]),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    entry_points={"console_scripts": [f"{NAME} = {NAME}.__main__:main"]},
)
