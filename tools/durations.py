"""Record how long tests take: a plugin of pytest that `make test-durations` loads.

It writes `tests/durations.json`: processor seconds of each test function, its set-up, all of its cases and the
processes that it starts together, by the function's node id. Processor time says the same on a busy machine.
`tools/near_tests.py` chooses by it what fits into a minute.
"""

import json
import os
from collections import defaultdict
from collections.abc import Generator
from pathlib import Path

import pytest

FILE = Path(__file__).resolve().parents[1] / "tests" / "durations.json"

_seconds: defaultdict[str, float] = defaultdict(float)


def _processor_seconds() -> float:
    """What this process and those that it has waited for took so far."""
    return sum(os.times()[:4])


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Put into the report of a set-up, call or tear-down what it took since the last one."""
    report = yield
    now = _processor_seconds()
    report.processor_seconds = now - getattr(item.config, "processor_seconds", now)  # type: ignore[attr-defined]
    item.config.processor_seconds = now  # type: ignore[attr-defined]
    return report


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add the seconds of a report to those of its function."""
    _seconds[report.nodeid.split("[")[0]] += getattr(report, "processor_seconds", 0.0)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write the file, where this is the process that started the others; functions that did not run stay."""
    if hasattr(session.config, "workerinput"):
        return
    known = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    known |= {name: round(seconds, 2) for name, seconds in _seconds.items()}
    FILE.write_text(json.dumps(known, indent=0, sort_keys=True) + "\n", encoding="utf-8")
