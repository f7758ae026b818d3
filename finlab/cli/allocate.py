"""`finlab allocate`: one target wrench in, one command per fin out, as a table or as JSON."""

from __future__ import annotations

from math import isnan
from typing import Annotated, Any

from tyro.conf import Positional, UseAppendAction, arg

from finlab.cli.json_file import JsonFile, check_json_file, put_json

Wrench = tuple[float, float, float, float, float, float]
Flow = Wrench


def allocate(
    layout: Annotated[Positional[str], arg(metavar="LAYOUT")],
    wrench: Annotated[Wrench, arg(metavar="FX FY FZ TX TY TZ")],
    failed: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")] = (),
    method: Annotated[str, arg(metavar="NAME")] = "dual",
    robust: Annotated[float | None, arg(metavar="W")] = None,
    checkpoint: Annotated[str | None, arg(metavar="NAME|FOLDER")] = None,
    policy: Annotated[str, arg(metavar="NAME")] = "closest",
    axis_weights: Annotated[Wrench | None, arg(metavar="W1 ... W6")] = None,
    priority: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="AXES")] = (),
    health: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME=SHARE")] = (),
    torn: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME=SHARE")] = (),
    stuck: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME=DEG")] = (),
    running: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME=A,F,DEG")] = (),
    flow: Annotated[Flow | None, arg(metavar="VX VY VZ WX WY WZ")] = None,
    bound: bool = False,
    seed: Annotated[int, arg(metavar="N")] = 0,
    json: JsonFile = None,
) -> None:
    """Find the command of each fin that gives a target wrench.

    Args:
        layout: layout file, bundle, or the name of a shipped layout.
        wrench: target in the body frame [N, N m]; nan for an axis that does not count.
        failed: name of a fin that does not work.
        method: dual, mdn, paper, qp, sqp, paper_sqp, px4, ardusub, analytic,
            fixed_frequency or ipopt.
        robust: for method dual: watts that an expected error of 1 % of the yardstick is worth.
        checkpoint: trained checkpoint; the shipped one of the method by default.
        policy: for a wrench out of reach: closest, direction (same direction, scaled down) or priority.
        axis_weights: for `closest`: weight of each axis of the error.
        priority: for `priority`: a group of axes with commas between, most important first, such as Fz,Tz.
        health: a weak actuator: share that is left of its limits, such as bow=0.5.
        torn: a fin or rudder that gives a share of its force at every command.
        stuck: a fin or azimuth that no longer turns: the angle at which it stays [deg].
        running: a fin that no longer listens: the command that it keeps [rad, Hz, deg].
        flow: velocity of the robot relative to the water, body frame [m/s, rad/s]; it is at rest by default.
        bound: tell as well the power [W] that no answer can undercut.
        seed: same target, layout and seed, same answer.
        json: file for one JSON object; it is printed in place of the table where no file is named.
    """
    from finlab.allocation import Allocator, Health
    from finlab.allocation.policy import policy_from
    from finlab.cli.inputs import open_robot
    from finlab.deploy.record import allocation_record
    from finlab.errors import FinlabError

    check_json_file(json)
    if any(map(isnan, wrench)) and not any(value for value in wrench if not isnan(value)):
        raise FinlabError("wrench: asks for nothing, since every axis is 0 or free; expected a value on one")
    robot, lost = open_robot(layout, failed)
    options: dict[str, Any] = {} if robust is None else {"robust": robust}
    allocator = Allocator(robot, method, checkpoint=checkpoint, **options)
    answer = policy_from(policy, axis_weights, priority)
    damage = Health.parse(health, torn, stuck, running)
    result = allocator.allocate(wrench, failed=lost, policy=answer, health=damage, flow=flow, seed=seed)
    lines = [str(result)]
    if bound and result.bound is None:
        raise FinlabError(f"bound: method {method!r} proves none; leave --bound out")
    if bound:
        lines.append(f"no exact answer takes less than {result.bound:.4g} W")
    put_json(allocation_record(result), json, "\n".join(lines))
