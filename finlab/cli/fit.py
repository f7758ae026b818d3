"""`finlab fit thruster|fin|interaction`: fits models of actuators to measurements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from finlab.cli.shared_options import Robot, open_robot, tell

if TYPE_CHECKING:
    from finlab.fit.interaction.samples import Samples
    from finlab.layout.layout import Layout


def fin(
    data: Annotated[Positional[tuple[Path, ...]], arg(metavar="DATA.csv...")],
    output: Annotated[Path, arg(metavar="FIN.csv", aliases=["-o"])],
    seed: int = 0,
) -> None:
    """Fit a fin to a load cell's measurements, and write it for layouts to name.

    Files hold cycle means (A, f, Fy, Fz and perhaps phi, Fx, P); A is half the stroke, phi the zero
    direction, forces are in the fin frame (x' shaft, y' horizontal thrust axis, z' up). Units may
    stand in the header, `A [deg]`, as may `stroke` for whole strokes in place of A.

    Args:
        data: CSV files of one fin.
        output: the fitted fin.
        seed: draws samples where there are too many.
    """
    from finlab.files.worker import in_worker
    from finlab.fit.fin_fit import check_table_path, fit_fin, summary, write_fin
    from finlab.fit.measurements import read_measurements

    check_table_path(output)
    fit = fit_fin(in_worker(read_measurements, data), seed, tell)
    write_fin(fit, output)
    print("\n".join(summary(fit)))
    print(f"{output}: name it in a layout, model: {{type: table, path: {output.name}}}")


def thruster(
    data: Annotated[Positional[tuple[Path, ...]], arg(metavar="DATA.csv...")],
    output: Annotated[Path, arg(metavar="TABLE.csv", aliases=["-o"])],
    voltage: float | None = None,
) -> None:
    """Fit a thruster to its bench table.

    The table has a command (PWM, or input from -1 to 1, or rpm), force, and power or voltage and
    current, and perhaps torque; units stand in the header, `force [kgf]`. Commands may be repeated.
    What is printed goes into a layout. `finlab fit fin` is for fins. Of a workbook (.xlsx) all
    sheets are read that hold a table.

    Args:
        data: CSV files or workbooks of one thruster.
        output: the table of thrust.
        voltage: which of several counts [V]; between two of them forces and powers are
            interpolated.
    """
    from finlab.errors import DataError
    from finlab.files.worker import in_worker
    from finlab.fit.fin_fit import check_table_path
    from finlab.fit.thruster_bench import read_bench
    from finlab.fit.thruster_fit import fit_thruster, layout_lines, summary, thruster_csv
    from finlab.whole_file import write_whole

    check_table_path(output)
    fit = fit_thruster(in_worker(read_bench, data, voltage))
    write_whole(output, thruster_csv(fit, output), DataError)
    print("\n".join(summary(fit)))
    print(f"\n{output}: in a layout's thruster\n  " + "\n  ".join(layout_lines(fit, output)))


def interaction(
    layout: Robot,
    samples: Annotated[Positional[Path], arg(metavar="SAMPLES.csv")],
    output: Annotated[Path | None, arg(metavar="LAYOUT2", aliases=["-o"])] = None,
    prior: Annotated[str | None, arg(metavar="NAME|FILE")] = None,
) -> None:
    """Fit what a robot's actuators do to each other and to its hull to samples of this robot.

    The file has a column for each number of a command, NAME.A, NAME.f, NAME.phi of a fin,
    NAME.force of a thruster, NAME.angle and NAME.force of an azimuth, and the wrench Fx, Fy, Fz,
    Tx, Ty, Tz [N, N m], body frame, measured with the robot held. Twenty samples at random commands
    do. Of a robot that is towed, vx, vy, vz, wx, wy, wz [m/s, rad/s] are its velocity through the
    water, body frame; what is not there is 0.

    Args:
        layout: layout file or the name of a shipped layout.
        samples: the CSV file.
        output: the layout with the fitted interaction, and beside it the file of its weights.
        prior: what is known of other robots: `several_plants`, the shipped one, or a file of
            `finlab train interaction`. The samples change it by as much as they say. Without it,
            the eight constants of the formula of jets are fitted.
    """
    from dataclasses import replace

    from finlab.files.worker import in_worker
    from finlab.fit.interaction.samples import read_table
    from finlab.layout.save import plain, save_layout

    robot = open_robot(layout)[0]
    measured = in_worker(read_table, robot, samples)
    if prior is not None:
        _fit_to_prior(robot, measured, output, prior)
        return
    from finlab.fit.interaction.constants import fit_constants

    fit = fit_constants(measured)
    print(
        f"laws alone miss {fit.laws:.3g} of the wrench scale (root mean square), with jets "
        f"{fit.left:.3g}"
    )
    print(f"interaction: {plain(fit.jets)}".replace("'", ""))
    if output is not None:
        save_layout(replace(robot, interaction=fit.jets), output)
        print(f"{output}: the robot with these jets")


def _fit_to_prior(robot: Layout, measured: Samples, output: Path | None, prior: str) -> None:
    """Fits weights of a linear interaction, says what they leave, and writes robot and weights."""
    from dataclasses import replace

    from finlab.fit.interaction.own_samples import fit_weights
    from finlab.interaction.linear import (
        SHIPPED_PRIOR,
        WEIGHTS_SUFFIX,
        Linear,
        read_weights,
        write_weights,
    )
    from finlab.layout.save import save_layout

    known = read_weights(str(SHIPPED_PRIOR) if prior == SHIPPED_PRIOR.stem else prior)
    fit = fit_weights(measured, known)
    print(
        f"laws alone miss {fit.laws:.3g} of the wrench scale (root mean square), the prior "
        f"{fit.before:.3g}, with these samples {fit.after:.3g}"
    )
    if output is None:
        return
    file = output.with_suffix(WEIGHTS_SUFFIX)
    write_weights(file, fit.weights)
    # Paths in a layout start in its folder: both files can be moved together.
    save_layout(replace(robot, interaction=Linear(file.name)), output)
    print(f"{output}, {file}: the robot with this interaction, and its weights")
