"""`finlab allocate` and `finlab export`: answers for a robot here and on board."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, cast

from tyro.conf import UseAppendAction, arg

from finlab.cli import shared_options
from finlab.errors import FinlabError

if TYPE_CHECKING:
    from finlab.allocation import MethodName
    from finlab.axes import Axis


def allocate(
    layout: shared_options.Robot,
    wrench: Annotated[shared_options.Wrench, arg(metavar="FX FY FZ TX TY TZ")],
    lost: shared_options.Lost = (),
    free: shared_options.Free = (),
    method: Annotated[str, arg(metavar="NAME")] = "dual",
    robust: Annotated[float | None, arg(metavar="W")] = None,
    checkpoint: Annotated[str | None, arg(metavar="NAME|FOLDER")] = None,
    policy: Annotated[str, arg(metavar="NAME")] = "closest",
    axis_weights: Annotated[shared_options.Wrench | None, arg(metavar="W1 ... W6")] = None,
    priority: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="AXES")] = (),
    falling: Annotated[str | None, arg(metavar="AXES")] = None,
    weak: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME=SHARE")] = (),
    torn: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME=SHARE")] = (),
    stuck: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME=DEG|N")] = (),
    running: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME=A,F,DEG|DEG,N|N")] = (),
    flow: shared_options.Flow = None,
    power: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="W|BUS=W")] = (),
    bound: bool = False,
    seed: shared_options.Count = 0,
    json: shared_options.JsonFile = None,
) -> None:
    """Find the command of each fin that gives a target wrench.

    Args:
        wrench: target in the body frame [N, N m].
        lost: name of an actuator that does not work.
        free: an axis that may take any wrench, such as Ty.
        method: dual, mdn, paper, qp, sqp, paper_sqp, px4, ardusub, analytic, fixed_frequency or
            ipopt.
        robust: for method dual: watts that an expected error of 1 % of the wrench scale is worth.
        checkpoint: trained checkpoint; the shipped one of the method by default.
        policy: for a wrench out of reach: closest, direction (same direction, scaled down),
            priority, or falling (no axis is given more than was asked for).
        axis_weights: for `closest`: weight of each axis of the error.
        priority: for `priority`: a group of axes with commas between, most important first, such as
            Fz,Tz.
        falling: for `falling`: the axes that may be given less and not more, with commas between;
            all by default.
        weak: an actuator of less strength: share that is left of its limits, such as bow=0.5.
        torn: a fin or rudder that gives a share of its force at every command.
        stuck: where one stays: the angle at which a fin or azimuth no longer turns [deg], or the
            force at which a thruster hangs [N].
        running: the command that one keeps whatever is asked: of a fin A,F,DEG [rad, Hz, deg], of
            an azimuth DEG,N [deg, N], of a thruster N [N].
        power: for method dual: the most that all actuators may take together [W], or those of a
            power bus of the layout, such as aft=60; inf for no limit.
        bound: tell as well the power [W] that no answer can undercut.
        seed: same target, layout and seed, same answer.
    """
    from finlab.allocation import Allocator
    from finlab.allocation.policy import policy_from
    from finlab.allocation.report import allocation_record
    from finlab.display import prefix_of
    from finlab.layout.damage import Damage

    shared_options.check_json_file(json)
    robot, gone = shared_options.open_robot(layout, lost)
    options: dict[str, Any] = {} if robust is None else {"robust": robust}
    # Names that are none are refused there, in sentences.
    name = cast("MethodName", method)
    axes = cast("tuple[Axis, ...]", free)
    allocator = Allocator(robot, name, checkpoint=checkpoint, **options)
    answer = policy_from(policy, axis_weights, priority, falling)
    watts = None
    if power:
        from finlab.allocation.power_budget import power_from

        watts = power_from(power)
    damage = Damage.parse(robot, gone, weak, torn, stuck, running)
    result = allocator.allocate(
        wrench, damage=damage, free=axes, policy=answer, flow=flow, seed=seed, power=watts
    )
    lines = [str(result)]
    if bound and result.bound is None:
        raise FinlabError(f"bound: method {method!r} proves none; leave --bound out")
    if bound and result.bound is not None:
        prefix = prefix_of(result.bound)
        least = f"{result.bound / prefix.factor:.4g} {prefix.symbol}W"
        lines.append(f"no exact answer takes less than {least}")
    shared_options.put_json(allocation_record(result), json, "\n".join(lines))


def export(
    layout: shared_options.Robot,
    output: Annotated[Path | None, arg(metavar="DIR", aliases=["-o"])] = None,
    graph: Annotated[Path | None, arg(metavar="FILE")] = None,
    c: Annotated[Path | None, arg(metavar="DIR")] = None,
    zip: bool = False,
    lost: shared_options.Lost = (),
    method: Literal["dual", "mdn", "paper"] = "dual",
    checkpoint: Annotated[str | None, arg(metavar="NAME|FOLDER")] = None,
    flow: shared_options.Flow = None,
) -> None:
    """Write the deployment bundle (the robot, its actuators' physics, settings, README, checksums),
    the layout graph file, or the allocator in C for a microcontroller.

    Args:
        output: folder to write the bundle to.
        graph: file to write the graph of actuators to (JSON, node-link form), for networkx and
            learners.
        c: folder to write the C99 sources of method dual for this robot to, with a self-test and
            examples.
        zip: write one archive, DIR.zip, instead of a folder.
        lost: name of an actuator that does not work.
        method: who answers on the robot: dual keeps watts least, mdn and paper the paper's effort.
        checkpoint: trained checkpoint of mdn or paper, which travels; the shipped one by default.
    """
    if output is None and graph is None and c is None:
        raise FinlabError(
            "nothing to write: expected -o DIR (bundle), --graph FILE, --c DIR, or several"
        )
    if c is not None and method != "dual":
        raise FinlabError(f"method {method!r}: has no C sources; leave --method out, or --c")
    if c is None and flow is not None:
        raise FinlabError(
            "flow: only C sources are of one speed; give --c DIR, too, or leave --flow out"
        )
    if output is not None and output.suffix == ".json":
        raise FinlabError(
            f"{output}: expected a folder, got the name of a file (a graph: --graph FILE)"
        )
    robot, gone = shared_options.open_robot(layout, lost)  # before a network is loaded
    left = robot.without(gone) if gone else robot
    if graph is not None:
        from finlab.deploy.robot_graph import write_graph

        write_graph(left, graph)
        print(f"{graph}: {robot.counts_in_words}, {left.n} nodes")
    if c is not None:
        from finlab.deploy.c_sources import c_sources, write_c

        files = c_sources(left, flow=flow)
        write_c(files, c)
        print(
            f"{c}: {left.counts_in_words}, {len(files)} files; "
            f"try: cc -std=c99 {c}/*.c -lm && ./a.out"
        )
        if flow is None and left.flow_driven:
            print(
                f"{', '.join(left.flow_driven)}: no force at rest; --flow says of which speed the "
                "files are"
            )
    if output is None:
        return
    from finlab.allocation import Allocator
    from finlab.deploy.bundle import make_bundle

    bundle = make_bundle(Allocator(robot, method, checkpoint=checkpoint), gone)
    if zip:
        output = output if output.suffix == ".zip" else output.with_name(output.name + ".zip")
        bundle.write_zip(output)
    else:
        bundle.write(output)
    size = sum(map(len, bundle.files.values())) / 1e6
    print(f"{output}: {robot.counts_in_words}, {len(bundle.files)} files, {size:.2f} MB")
    print(f"check it on the robot: finlab-runtime check {output.name}")
