"""`finlab-runtime check|allocate|serve BUNDLE`: the command that runs on the robot."""

import argparse
import json
import math
import os
import sys
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from finlab import __version__
from finlab.errors import EXIT_ERROR, FinlabError, exit_code

if TYPE_CHECKING:
    from finlab.deploy.deployed_robot import DeployedRobot

POLICIES = ("closest", "direction", "priority", "falling")
"""As `POLICY_NAMES` of `finlab.allocation.policy`, which cannot be imported here: it loads numpy,
before the number of its threads is set."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; 0 is good, 1 a self-test that failed, 2 an error in one sentence."""
    return exit_code("finlab-runtime", lambda: _run(argv))


def _run(argv: Sequence[str] | None) -> int:
    try:
        arguments = _parser().parse_args(argv)
    except SystemExit as end:  # help, version, or a wrong call, which argparse has printed
        return end.code if isinstance(end.code, int) else EXIT_ERROR
    # Before numpy is loaded: every product here is too small to be shared among cores.
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    arguments.started = time.perf_counter()
    code: int = arguments.run(arguments)
    return code


def _robot(arguments: argparse.Namespace) -> "DeployedRobot":
    from finlab.deploy.deployed_robot import load_robot

    return load_robot(arguments.bundle)


def check(arguments: argparse.Namespace) -> int:
    """Print each question of the self-test with its answer."""
    from finlab.deploy.deployed_robot import extremes, self_check

    robot = _robot(arguments)
    print(
        f"{arguments.bundle}: {robot.layout.name}, {robot.layout.counts_in_words}, method "
        f"{robot.allocator.method}, ready in {time.perf_counter() - arguments.started:.2f} s"
    )
    findings = [*self_check(robot), extremes(robot)]
    for finding in findings:
        word = "ok" if finding.good else "FAILED"
        print(f"  {word:6} {finding.question}: {finding.value:.2g}, allowed {finding.limit:.2g}")
    if all(finding.good for finding in findings):
        print("this computer answers as the one that made the bundle")
        return 0
    print(
        "do not use this bundle here: its answers are wrong, or not those of the computer that "
        "made it"
    )
    return 1


def allocate(arguments: argparse.Namespace) -> int:
    """Print the commands for one target."""
    from finlab.allocation.report import allocation_record

    answer = _robot(arguments).allocate(
        arguments.wrench,
        lost=arguments.lost,
        free=arguments.free,
        policy=arguments.policy,
        flow=arguments.flow,
        seed=arguments.seed,
    )
    print(json.dumps(allocation_record(answer), allow_nan=False) if arguments.json else answer)
    return 0


def serve(arguments: argparse.Namespace) -> int:
    """Answer requests until they end or a signal asks to stop. Raises FinlabError: a stream is
    closed."""
    from finlab.deploy.transport import StandardStreams

    streams = StandardStreams()  # before the robot is loaded, so that no signal is missed
    robot = _robot(arguments)
    from finlab.deploy.serve import Server

    if sys.stdin is None or not sys.stdout.writable():
        raise FinlabError("standard input or output is closed; connect both")
    streams.open(sys.stdin.fileno(), sys.stdout.fileno())
    Server(robot, None if arguments.no_watchdog else arguments.watchdog_s).run(streams)
    return 0


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.01 <= value <= 3600.0:
        raise argparse.ArgumentTypeError(f"expected a number from 0.01 to 3600, got {text!r:.40}")
    return value


class _Parser(argparse.ArgumentParser):
    """One that does not pass over an output that is full."""

    def _print_message(self, message: str, file: Any = None) -> None:
        print(message, end="", file=file or sys.stderr)


def _parser() -> argparse.ArgumentParser:
    program = "finlab-runtime"
    parser = _Parser(
        program,
        description="Control allocation on board.",
        epilog=f"example: {program} check my_robot",
    )
    parser.add_argument("--version", action="version", version=f"{program} {__version__}")
    verbs = parser.add_subparsers(required=True, metavar="check|allocate|serve")

    def verb(
        run: Callable[[argparse.Namespace], int], text: str, example: str
    ) -> argparse.ArgumentParser:
        subparser: argparse.ArgumentParser = verbs.add_parser(
            run.__name__, help=text, description=text, epilog=f"example: {example}"
        )
        subparser.set_defaults(run=run)
        bundle_help = "folder or zip archive made by `finlab export`"
        subparser.add_argument("bundle", metavar="BUNDLE", help=bundle_help)
        return subparser

    verb(
        check,
        "Run the self-test; do this on the robot before first use.",
        f"{program} check my_robot",
    )
    add = verb(
        allocate,
        "Commands for one target.",
        f"{program} allocate my_robot --wrench 1 0 0.5 0 0 0.1",
    ).add_argument
    names = ("FX", "FY", "FZ", "TX", "TY", "TZ")
    add("--wrench", nargs=6, type=float, required=True, metavar=names, help="[N, N m]")
    add("--lost", action="append", default=[], metavar="NAME", help="actuator that is lost")
    free_help = "axis that may take any wrench, such as Ty"
    add("--free", action="append", default=[], metavar="AXIS", help=free_help)
    add("--policy", choices=POLICIES, default="closest", help="what to do out of reach")
    speeds = ("VX", "VY", "VZ", "WX", "WY", "WZ")
    flow_help = "velocity relative to the water [m/s, rad/s]"
    add("--flow", nargs=6, type=float, metavar=speeds, help=flow_help)
    add("--seed", type=int, default=0, help="seed of the candidates")
    add("--json", action="store_true", help="print one JSON object")
    serve_parser = verb(
        serve,
        "Read targets as JSON lines, write commands as JSON lines.",
        f"""echo '{{"wrench": [1, 0, 0.5, 0, 0, 0.1]}}' | {program} serve my_robot""",
    )
    add_silence = serve_parser.add_mutually_exclusive_group().add_argument
    silence_help = "silence before the fins rest, 1 s if not said"
    add_silence("--watchdog-s", type=_seconds, default=1.0, metavar="S", help=silence_help)
    add_silence(
        "--no-watchdog",
        action="store_true",
        help="keep the last commands however long no target comes",
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
