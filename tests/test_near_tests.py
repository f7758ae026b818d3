"""Near tests are chosen by imports: those that need a changed file most directly come first."""

from pathlib import Path

import pytest

from tools.faults import PythonFile, c_faults
from tools.import_graph import ImportGraph
from tools.near_tests import near_tests

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def graph() -> ImportGraph:
    """The graph of imports of this tree."""
    return ImportGraph(ROOT)


@pytest.mark.parametrize(
    ("changed", "nearest"),
    [
        ("finlab/core/src/jets.c", "tests/core/test_core.py"),
        ("finlab/core/src/jets.c", "tests/interaction/test_jets.py"),
        ("finlab/core/src/foil_drag.c", "tests/allocation/dual/test_drag.py"),
        ("finlab/core/src/set_gaps.c", "tests/core/test_set_gaps.py"),
        ("finlab/allocation/baselines/ipopt.py", "tests/allocation/baselines/test_ipopt.py"),
        ("finlab/actuators/thruster.py", "tests/actuators/test_laws.py"),
        ("finlab/layout/damage.py", "tests/allocation/test_damage_of_robots.py"),
        ("webapp/panels/swim_tab.py", "tests/webapp/test_app.py"),
        ("tests/random_robots.py", "tests/allocation/dual/test_random_robots.py"),
    ],
)
def test_a_change_selects_its_tests(graph: ImportGraph, changed: str, nearest: str) -> None:
    tests = near_tests(graph, [changed])
    distance = min(test.distance for test in tests if test.file == nearest)
    assert distance <= 3
    assert sum(test.seconds for test in tests) <= 80.0


def test_tests_that_are_called_after_a_c_file_are_the_nearest(graph: ImportGraph) -> None:
    tests = near_tests(graph, ["finlab/core/src/jets.c"], seconds=3.0)
    assert tests[0].file == "tests/interaction/test_jets.py"


def test_a_registry_imports_what_it_names(graph: ImportGraph) -> None:
    assert "finlab/allocation/dual/method.py" in graph.imports("finlab/allocation/methods.py")
    assert "finlab/actuators/rudder.py" in graph.imports("finlab/actuators/kinds.py")
    tests = near_tests(graph, ["finlab/actuators/azimuth.py"])
    assert "tests/allocation/dual/test_reversing_pods.py" in {test.file for test in tests}


def test_nearer_tests_come_first_among_those_that_take_as_long(graph: ImportGraph) -> None:
    tests = near_tests(graph, ["finlab/allocation/policy.py"])
    quick = [test.distance for test in tests if test.seconds <= 0.1]
    assert quick == sorted(quick) and quick[-1] > quick[0]


def test_a_name_that_a_package_passes_on_leads_to_its_file(graph: ImportGraph) -> None:
    imports = graph.imports(
        "tests/allocation/test_question.py"
    )  # from finlab.allocation import Allocator
    assert (
        "finlab/allocation/allocator.py" in imports and "finlab/allocation/rates.py" not in imports
    )


def test_a_changed_test_file_runs_whole(graph: ImportGraph) -> None:
    file = "tests/core/test_c_export.py"
    tests = near_tests(graph, [file], seconds=0.0)
    assert {test.file for test in tests} == {file} and len(tests) > 5


def test_faults_of_python_are_where_numbers_are_computed() -> None:
    source = (
        'def f(a: tuple[int, 3]) -> float:\n    return min(a[0] - 1, -a[-1]) if a[0] < 2 else "-"\n'
    )
    made = {
        fault.applied(source).splitlines()[1].strip()
        for fault in PythonFile("f.py", source).faults()
    }
    assert 'return min(a[0] + 1, -a[-1]) if a[0] < 2 else "-"' in made
    assert 'return max(a[0] - 1, -a[-1]) if a[0] < 2 else "-"' in made
    assert 'return min(a[0] - 1, -a[-1]) if a[0] >= 2 else "-"' in made
    assert 'return min(a[1] - 1, -a[-1]) if a[0] < 2 else "-"' in made
    assert len(made) == 8


def test_faults_of_c_leave_sizes_and_comments_alone() -> None:
    source = """
/* a - b */
#define HALF(x) ((x) - 1)
static double last(const double *a, int n) {
  double sum[3] = {0}; // a < b
  for (int i = 0; i < n; i++) sum[0] += a[i];
  return n > 2 ? -sum[0] : MAX(a[0], a[1]);
}
"""
    made = {fault.applied(source) for fault in c_faults("f.c", source)}
    for line in (
        "sum[0] -= a[i]",
        "i < n - 1;",
        "n <= 2",
        "? sum[0]",
        "MIN(a[0], a[1])",
        "MAX(a[1], a[1])",
    ):
        assert any(line in text for text in made), line
    assert not any("a + b" in text or "(x) + 1" in text or "sum[2]" in text for text in made)


def test_the_sign_of_a_tolerance_is_known_by_what_follows_it() -> None:
    source = "a = b * (1 - CLOSE);\nc = d - CLOSEST;\ne = f + 2 * NOTHING;\ng = h - 0.5;\n"
    told = [fault.is_of_tolerance(source) for fault in c_faults("a.c", source)]
    assert told == [True, False, True, False]
    python = "a = b * (1.0 - 10.0 * NEARLY)\nc = d - e\n"
    faults = sorted(PythonFile("a.py", python).faults())
    of_python = [fault.is_of_tolerance(python) for fault in faults]
    assert of_python == [True, False]
