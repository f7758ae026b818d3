"""Capability plots: what a robot or ship can hold by heading, with all actuators and after each
single loss."""

import json
from dataclasses import dataclass
from pathlib import Path

from finlab.analysis.capability import HEADINGS, Capability, capability, dp_capability
from finlab.analysis.load_file import read_loads
from finlab.analysis.ship_file import read_ship
from finlab.errors import FinlabError
from finlab.files.worker import in_worker
from finlab.layout import Layout
from webapp.session.given_loads import GivenLoads
from webapp.session.state import Flow, State
from webapp.tasks.context import Context
from webapp.tasks.fitting import as_file, short_name
from webapp.tasks.slot import Slot, Work


@dataclass(frozen=True)
class CapabilityQuestion:
    """Which robot is to hold which loads."""

    layout: Layout
    """With the limits that damage has left."""
    lost: tuple[str, ...]
    """Names of its lost actuators."""
    flow: Flow | None
    """Velocity (6,) relative to the water [m/s, rad/s]; None at rest."""
    loads: GivenLoads | None
    """None for a force from each heading."""

    @staticmethod
    def of_state(state: State, loads: GivenLoads | None) -> "CapabilityQuestion":
        """The robot of a state, and loads."""
        return CapabilityQuestion(state.able, state.lost, state.flow, loads)


class CapabilityPlot(Slot[CapabilityQuestion, Capability]):
    """One plot at a time for one page, made when it is asked for."""

    def __init__(self, context: Context) -> None:
        super().__init__(context.pools.long, context.bell, find_capability, watched=True)


class Cancelled(FinlabError):
    """Nobody waits for the plot any more."""


def find_capability(question: CapabilityQuestion, work: Work[CapabilityQuestion]) -> Capability:
    """Returns what a robot can hold.

    Args:
        question: the robot and its loads.
        work: takes the share that is done, and ends it where it is cancelled.
    """

    def report(share: float) -> None:
        if work.cancelled.is_set():
            raise Cancelled("the capability plot was cancelled")
        work.report(share)

    layout = question.layout
    lost = question.lost
    loads = question.loads
    if loads is None:
        return capability(layout, None, HEADINGS, lost, question.flow, progress=report)
    if loads.ship is not None:
        return dp_capability(layout, loads.ship, HEADINGS, lost, progress=report)
    return capability(layout, loads.wrenches, loads.headings, lost, question.flow, progress=report)


def read_given_loads(name: str, content: bytes) -> GivenLoads:
    """The loads in an uploaded file: a table of wrenches (CSV), or a ship's particulars (YAML,
    JSON). FinlabError: it is neither."""
    file = short_name(name)
    with as_file(file, content) as path:
        if Path(file).suffix.lower() == ".csv":
            headings, wrench = in_worker(read_loads, path)
            wrenches = tuple(tuple(row) for row in wrench.tolist())
            return GivenLoads(file, headings=headings, wrenches=wrenches)
        return GivenLoads(file, ship=in_worker(read_ship, path))


def capability_json(plot: Capability) -> bytes:
    """The JSON file of a plot, with the certificates: as `finlab layout capability --json`."""
    return (json.dumps(plot.to_dict(), indent=1, allow_nan=False) + "\n").encode()
