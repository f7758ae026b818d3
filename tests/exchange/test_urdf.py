"""Layouts from and to robot descriptions."""

import math
from pathlib import Path

import numpy as np
import pytest

import finlab
from finlab.assets import shipped_layouts
from finlab.cli import main
from finlab.errors import LayoutError
from finlab.exchange import read_urdf, write_urdf
from tests.fin_robots import FIN_ROBOTS

TURTLE = Path(__file__).parent / "turtle.urdf"
FINS = ("front_right_fin", "front_left_fin", "tail_fin")


def test_rotated_links_and_axes_come_out_in_the_body_frame() -> None:
    layout = read_urdf(TURTLE, FINS, origin="base")
    right, left, tail = layout.fins
    c, s = math.cos(math.pi / 3), math.sin(math.pi / 3)
    np.testing.assert_allclose(right.position, [0.2 + 0.05 * c, -0.1 - 0.05 * s, 0.0], atol=1e-12)
    assert right.mounting_angle == pytest.approx(-math.pi / 3)
    np.testing.assert_allclose(left.position, [0.2, 0.1, 0.0], atol=1e-12)
    assert left.mounting_angle == pytest.approx(math.pi / 2), (
        "z of a frame turned about x, seen from the hull"
    )
    assert abs(tail.mounting_angle) == pytest.approx(math.pi)


def test_origin_moves_to_the_centre_of_gravity() -> None:
    base, gravity = (read_urdf(TURTLE, FINS, origin) for origin in ("base", "gravity"))
    for a, b in zip(base.fins, gravity.fins, strict=True):
        np.testing.assert_allclose(np.subtract(a.position, b.position), [0.02, 0.0, -0.01], atol=1e-12)
    assert gravity.body is not None and base.body is None
    assert gravity.body.mass_kg == 10.0
    np.testing.assert_allclose(gravity.body.inertia_kgm2, [0.1, 0.2, 0.3])


@pytest.mark.parametrize("name", sorted(FIN_ROBOTS))
def test_shipped_layouts_survive_the_way_there_and_back(name: str, tmp_path: Path) -> None:
    layout = finlab.load_layout(shipped_layouts()[name])
    write_urdf(layout, tmp_path / "robot.urdf")
    back = read_urdf(tmp_path / "robot.urdf", layout.names, origin="base")
    for a, b in zip(layout.fins, back.fins, strict=True):
        np.testing.assert_allclose(a.position, b.position, atol=1e-12)
        # A shaft that points into the hull comes back pointing out of it.
        apart = math.remainder(a.mounting_angle - b.mounting_angle, math.pi)
        assert apart == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("content", "fins", "message"),
    [
        ("<!DOCTYPE a [<!ENTITY x 'y'>]><robot name='a'/>", ("x",), "declares a DOCTYPE"),
        ("no xml at all", ("x",), "is not a readable URDF"),
        (
            TURTLE.read_text(),
            ("nobody",),
            "has no link 'nobody' that a joint moves; such links: front_left_fin",
        ),
        (TURTLE.read_text(), ("mount",), "joint 'mount_joint' is fixed; a fin's joint turns"),
        (TURTLE.read_text(), ("rudder",), "leaves the horizontal plane by 90 degrees"),
        (TURTLE.read_text(), (), "name the links that are fins"),
        (TURTLE.read_text().replace('mass value="10"', 'mass value="0"'), FINS, "has no masses"),
        (
            TURTLE.read_text().replace('origin xyz="0.2 ', 'origin xyz="20 '),
            FINS,
            r"position_m\[0\]: must lie",
        ),
    ],
)
def test_refusals_say_what_is_wrong(
    content: str, fins: tuple[str, ...], message: str, tmp_path: Path
) -> None:
    path = tmp_path / "x.urdf"
    path.write_text(content)
    with pytest.raises(LayoutError, match=message) as caught:
        read_urdf(path, fins)
    assert str(caught.value).startswith(f"{path}: ")


def test_verbs_import_and_export(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made, out = tmp_path / "turtle.yaml", tmp_path / "turtle.urdf"
    assert main(["layout", "import", str(TURTLE), "-o", str(made), "--fins", *FINS]) == 0
    assert main(["layout", "check", str(made)]) == 0
    assert finlab.load_layout(made).names == FINS
    assert main(["layout", "export", str(made), "-o", str(out)]) == 0
    assert read_urdf(out, FINS).n_fins == 3
    assert main(["layout", "export", str(made), "-o", str(tmp_path / "x.pdf")]) == 2
    assert "expected a file that ends in .urdf" in capsys.readouterr().err
