"""Records how long tests take: a plugin of pytest that `make test-durations` loads.

It writes `tests/durations.json`: processor seconds of each test, its set-up and the processes that
it starts included, by its node id; of a function whose cases take less than a second together one
number, by the function's. Processor time says the same on a busy machine. `tools/near_tests.py`
chooses by it what fits into a minute.
"""

import json
import os
from collections import defaultdict
from collections.abc import Generator
from pathlib import Path

import pytest

FILE = Path(__file__).resolve().parents[1] / "tests" / "durations.json"
"""The file that is written."""
SPLIT_FROM = 1.0
"""Processor time of a function from which on its cases are recorded one by one [s]."""
_seconds: defaultdict[str, float] = defaultdict(float)
"""Processor time of each test so far [s], by node id."""


def _processor_seconds() -> float:
    """Processor time of this process and of those that it has waited for [s]."""
    return sum(os.times()[:4])


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Put into the report of a set-up, call or tear-down what it took since the last one."""
    report = yield
    seconds = _processor_seconds()
    report.processor_seconds = seconds - getattr(item.config, "processor_seconds", seconds)  # type: ignore[attr-defined]
    item.config.processor_seconds = seconds  # type: ignore[attr-defined]
    return report


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add the seconds of a report to those of its test."""
    _seconds[report.nodeid] += getattr(report, "processor_seconds", 0.0)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write the file, where this is the process that started the others; functions that did not run
    stay."""
    if hasattr(session.config, "workerinput"):
        return
    sums = defaultdict[str, float](float)
    for name, seconds in _seconds.items():
        sums[function_of(name)] += seconds
    recorded = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    recorded = {
        name: seconds for name, seconds in recorded.items() if function_of(name) not in sums
    }
    for name, seconds in _seconds.items():
        function = function_of(name)
        is_slow = sums[function] >= SPLIT_FROM
        recorded[name if is_slow else function] = round(seconds if is_slow else sums[function], 2)
    FILE.write_text(json.dumps(recorded, indent=0, sort_keys=True) + "\n", encoding="utf-8")


def function_of(name: str) -> str:
    """The node id of a test's function."""
    return name.split("[")[0]
