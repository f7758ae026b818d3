"""What colcon builds and ROS 2 reads: the package's files fit each other."""

import ast
import re
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import yaml
from finlab_allocator.parameters import Parameters, descriptions

import finlab

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "ros2" / "finlab_allocator"
OF_ROS = {"ament_index_python", "launch", "launch_ros", "rclpy"}
"""Packages of ROS without messages."""


def test_the_packages_that_are_imported_are_required() -> None:
    imported = set[str]()
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module:
                imported.add(node.module.split(".")[0])
            if isinstance(node, ast.Import):
                imported |= {alias.name.split(".")[0] for alias in node.names}
    needed = {name for name in imported if name in OF_ROS or name.endswith(("_msgs", "interfaces"))}
    about = ElementTree.parse(PACKAGE / "package.xml").getroot()
    required = {str(each.text) for each in about.findall("exec_depend")}
    assert needed <= required and required - needed == {"python3-numpy"}
    assert about.findtext("name") == "finlab_allocator"
    assert about.findtext("version") == finlab.__version__
    assert about.findtext("export/build_type") == "ament_python"


def test_the_file_of_parameters_is_taken() -> None:
    text = (PACKAGE / "config" / "allocator.yaml").read_text()
    values = yaml.safe_load(text)["/**"]["ros__parameters"]
    parameters = Parameters().changed(values)
    assert parameters.robot == "bluerov2_heavy" and parameters.policy == "direction"
    for name in descriptions():
        assert f" {name}:" in text or name == "power_w"
    uncommented = yaml.safe_load(re.sub(r"    # (?=\w+:)", "    ", text))["/**"]["ros__parameters"]
    assert Parameters().changed(uncommented).lost == ("front_left",)


def test_the_page_has_each_parameter() -> None:
    page = (ROOT / "docs" / "howto" / "ros2.md").read_text()
    for name in descriptions():
        assert f"`{name}`" in page


def test_it_installs_with_its_files_and_its_command(tmp_path: Path) -> None:
    source = shutil.copytree(PACKAGE, tmp_path / "source")
    site = tmp_path / "site"
    site.mkdir()
    steps = ["egg_info", "--egg-base", str(site), "install_data", "--install-dir", str(site)]
    command = [sys.executable, "setup.py", "--quiet", *steps]
    done = subprocess.run(command, cwd=source, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (site / "share/ament_index/resource_index/packages/finlab_allocator").exists()
    for name in ("package.xml", "README.md", "launch/allocator_launch.py", "config/allocator.yaml"):
        assert (site / "share" / "finlab_allocator" / name).exists()
    (about,) = site.glob("*.egg-info/entry_points.txt")
    assert "finlab_allocator = finlab_allocator.__main__:main" in about.read_text()
