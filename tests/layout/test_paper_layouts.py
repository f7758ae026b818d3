"""Layouts A-D: the files against the numbers the paper prints, converted here once more."""

import numpy as np
import pytest

from finlab.assets import shipped_folder
from finlab.layout import layout_effectiveness, load_layout

# The paper's table of layouts: x, y, z [m], alpha [deg] of each fin, in the paper's own axes.
AS_PRINTED = {
    "A": [
        (0.1502, 0.25753, 0, 30),
        (-0.1502, 0.25753, 0, 150),
        (-0.1502, -0.25753, 0, -150),
        (0.1502, -0.25753, 0, -30),
    ],
    "B": [(0.250, 0, 0, 0), (0, -0.250, 0, -90), (-0.250, 0, 0, 180), (0, 0.250, 0, 90)],
    "C": [(0, 0, 0.200, 0), (0.096, -0.226, 0, -45), (0, 0, -0.200, 180), (-0.096, 0.226, 0, 135)],
    "D": [(0.150, 0.200, 0, 0), (-0.050, -0.200, 0, 0), (-0.150, 0.200, 0, 180)],
}
SURGE_HEAVE_YAW = [0, 2, 5]
"""Indices of these axes in a wrench."""


@pytest.mark.parametrize("name", AS_PRINTED)
def test_the_file_is_the_printed_layout_with_y_forward_and_alpha_the_shaft(name):
    layout = load_layout(shipped_folder("layouts") / f"{name}.yaml")
    assert layout.name == name
    assert layout.n_fins == len(AS_PRINTED[name])
    for fin, (x, y, z, alpha) in zip(layout.fins, AS_PRINTED[name], strict=True):
        assert fin.position == pytest.approx((y, -x, z), abs=1e-12)
        turn = np.degrees(fin.mounting_angle) - (alpha - 90.0)
        assert (turn + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=1e-9)
        assert -180.0 < np.degrees(fin.mounting_angle) <= 180.0 + 1e-9


@pytest.mark.parametrize("name", AS_PRINTED)
def test_surge_heave_and_yaw_stay_controllable_after_any_single_loss(name):
    layout = load_layout(shipped_folder("layouts") / f"{name}.yaml")
    for robot in [layout, *(layout.without([fin]) for fin in layout.names)]:
        rows = layout_effectiveness(robot)[SURGE_HEAVE_YAW]
        assert np.linalg.matrix_rank(rows, tol=1e-6) == 3, robot.names


def test_read_as_printed_in_the_body_frame_layouts_b_and_d_could_not_do_what_the_paper_shows():
    """Why a conversion is needed at all: yaw of B and surge of D would be missing."""
    from finlab.layout.effectiveness import force_effectiveness

    def rows(name, thrust_axis_offset_deg):
        numbers = np.array(AS_PRINTED[name], dtype=float)
        columns = force_effectiveness(
            numbers[:, :3], np.radians(numbers[:, 3] + thrust_axis_offset_deg)
        )
        return columns[:, 1:].reshape(-1, 6).T

    # alpha as the direction of the horizontal force: that axis lies 90 degrees ahead of the shaft.
    assert np.abs(rows("B", -90.0)[5]).max() < 1e-12
    # alpha as the shaft, but x forward.
    assert np.abs(rows("D", 0.0)[0]).max() < 1e-12
