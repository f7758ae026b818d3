"""Imports go one way, and heavy packages stay in their rooms: read from the source, not from a run."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import networkx as nx
import pytest

ROOT = Path(__file__).resolve().parents[1]

LEVELS = (
    ("errors", "arrays"),
    ("axes", "core", "files", "assets", "command_end", "least_squares", "precision", "whole_file"),
    ("bundle_files", "executor"),
    ("actuators",),
    ("interaction",),
    ("layout",),
    ("physics", "exchange"),
    ("vehicle",),
    ("networks", "hull"),
    ("forces", "training"),
    ("allocation",),
    ("control", "paper"),
    ("mdn", "sim", "analysis", "fit"),
    ("evaluation", "deploy"),
    ("log",),
    ("cli",),
)
"""A room may import rooms of earlier levels and itself, never its neighbours or later ones."""

LEVEL = {room: level for level, rooms in enumerate(LEVELS) for room in rooms}


def _sources(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def _imports(path: Path) -> Iterator[tuple[str, int]]:
    """Every module that a file imports, wherever in it, with the line; those for type checkers, too."""
    for node in ast.walk(_tree(path)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, node.lineno
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: import by the full name, not relatively"
            assert node.module is not None
            yield node.module, node.lineno
            for alias in node.names:  # `from finlab import cli` imports a room by its name
                if node.module == "finlab":
                    yield f"finlab.{alias.name}", node.lineno


def _room(module: str) -> str | None:
    parts = module.split(".")
    return parts[1] if parts[0] == "finlab" and len(parts) > 1 and parts[1] in LEVEL else None


def test_every_room_is_known() -> None:
    paths = [path for path in (ROOT / "finlab").iterdir() if path.suffix in ("", ".py")]
    rooms = {path.stem if path.is_file() else path.name for path in paths}
    rooms -= {"__init__", "__main__", "__pycache__"}
    assert rooms <= set(LEVEL), "give a new room its place in LEVELS"


def test_imports_go_one_way() -> None:
    wrong = []
    for path in _sources("finlab"):
        relative = path.relative_to(ROOT / "finlab")
        here = relative.parts[0].removesuffix(".py")
        if here not in LEVEL:  # finlab/__init__.py and __main__.py are the front door
            continue
        for module, line in _imports(path):
            there = _room(module)
            if there not in (None, here) and LEVEL[str(there)] >= LEVEL[here]:
                wrong.append(f"finlab/{relative}:{line} imports {module}")
    assert not wrong, "\n".join(wrong)


def _modules(root: Path) -> dict[str, Path]:
    """Every module of finlab and webapp by its full name."""
    named = {}
    for package in ("finlab", "webapp"):
        for path in sorted((root / package).rglob("*.py")):
            parts = path.relative_to(root).with_suffix("").parts
            named[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return named


def _import_graph(root: Path) -> "nx.DiGraph[str]":
    """Which module needs which, at once, later (in functions, or by a name given to `import_module`), or for
    types; a package's own file only where something is asked of it by name."""
    modules = _modules(root)
    graph: nx.DiGraph[str] = nx.DiGraph()
    for name, path in modules.items():
        by_name = "import_module" in path.read_text(encoding="utf-8")
        for node in ast.walk(_tree(path)):
            wanted: list[str] = []
            if isinstance(node, ast.Import):
                wanted = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                inside = [f"{node.module}.{alias.name}" for alias in node.names]
                wanted = [full if full in modules else str(node.module) for full in inside]
            elif by_name and isinstance(node, ast.Constant) and isinstance(node.value, str):
                wanted = [node.value]
            graph.add_edges_from((name, module) for module in wanted if module in modules)
    return graph


def _shortest_circles(graph: "nx.DiGraph[str]") -> list[list[str]]:
    """One smallest circle for each group of modules that need each other, its first module also last."""
    circles = []
    for group in nx.strongly_connected_components(graph):
        found = [
            [start, *nx.shortest_path(graph, then, start)]
            for start in group
            for then in graph.successors(start)
            if then in group
        ]
        if found:
            circles.append(min(found, key=lambda circle: (len(circle), circle)))
    return sorted(circles)


def test_modules_import_each_other_in_no_circle() -> None:
    circles = _shortest_circles(_import_graph(ROOT))
    assert not circles, "\n".join(map(" -> ".join, circles))


def test_circles_of_imports_are_found(tmp_path: Path) -> None:
    for name, text in {
        "finlab/__init__.py": "",
        "finlab/first.py": "from finlab import second\n",
        "finlab/second.py": "try:\n    import finlab.third\nexcept ImportError:\n    pass\n",
        "finlab/third.py": "from finlab.first import name\nfrom webapp import fourth\n",
        "webapp/fourth.py": "if TYPE_CHECKING:\n    import finlab.third\nimport webapp.sixth\n",
        "webapp/fifth.py": "def later():\n    import webapp.sixth\n",
        "webapp/sixth.py": "HOME = 'webapp.fifth'\nimportlib.import_module(HOME)\n",
    }.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    assert _shortest_circles(_import_graph(tmp_path)) == [
        ["finlab.third", "webapp.fourth", "finlab.third"],
        ["webapp.fifth", "webapp.sixth", "webapp.fifth"],
    ]


@pytest.mark.parametrize(
    ("package", "banned"),
    [
        ("finlab", ("viser", "webapp", "playwright")),
        *((f"finlab/{room}", ("trimesh",)) for rooms in LEVELS for room in rooms if room != "hull"),
        ("finlab/layout", ("torch", "scipy", "matplotlib")),
        ("finlab/actuators", ("torch", "scipy", "matplotlib")),
        *((f"finlab/{room}", ("torch",)) for room in ("evaluation", "sim", "control", "exchange")),
        ("webapp", ("finlab.cli",)),
        ("finlab/networks", ("torch", "scipy")),
    ],
)
def test_rooms_do_without(package: str, banned: tuple[str, ...]) -> None:
    door = "finlab/cli/robot_verbs.py"  # the one place that starts the web app
    wrong = [
        f"{path.relative_to(ROOT)}:{line} imports {module}"
        for path in _sources(package)
        if path.relative_to(ROOT).as_posix() != door
        for module, line in _imports(path)
        if any(module == name or module.startswith(name + ".") for name in banned)
    ]
    assert not wrong, "\n".join(wrong)


def test_front_door_and_layouts_load_no_torch() -> None:
    code = (
        "import sys, finlab, finlab.layout, finlab.cli, finlab.assets\n"
        "from finlab.cli import main\n"
        "assert main(['layout', 'check', 'A']) == 0\n"
        "print(sorted({'torch', 'scipy', 'viser', 'matplotlib'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout.splitlines()[-1] == "[]"


def test_allocating_needs_only_numpy_and_msgspec() -> None:
    """What a robot's computer runs; DEVELOPMENT.md promises it."""
    code = (
        "import sys\n"
        "for name in ('torch', 'scipy', 'yaml', 'safetensors', 'threadpoolctl', 'tqdm', 'tyro'):\n"
        "    sys.modules[name] = None\n"
        "import finlab.allocation.dual.method, finlab.mdn.method, finlab.deploy.deployed_robot"
    )
    subprocess.run([sys.executable, "-c", code], timeout=60, check=True)
