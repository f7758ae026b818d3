"""Imports go one way, and heavy packages stay in their rooms: read from the source, not from a
run."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from itertools import chain
from pathlib import Path
from pkgutil import resolve_name

import networkx as nx
import pytest

ROOT = Path(__file__).resolve().parents[1]

Levels = tuple[tuple[str, ...], ...]
"""Rooms that may import those of earlier levels and themselves, never their neighbours or later
ones."""

CORE: Levels = (
    ("arrays", "errors"),
    ("assets", "axes", "core", "files", "least_squares", "whole_file"),
    ("bundle_files", "display"),
    ("actuators",),
    ("interaction",),
    ("layout",),
    ("physics", "exchange"),
    ("allocation",),
    ("forces",),
    ("analysis", "fit"),
    ("deploy",),
)
"""What allocates, and what is said of a robot that allocates. It imports no wing."""

WINGS: dict[str, Levels] = {
    "swim": (
        ("swim/vehicle",),
        ("swim/hull", "swim/control"),
        ("swim/simulation", "swim/identification", "swim/design_files"),
    ),
    "research": (
        ("research/executor", "research/networks", "research/random_layouts"),
        ("research/training",),
        ("research/paper", "research/interaction", "research/distilled"),
        ("research/mdn",),
        ("research/evaluation",),
    ),
    "logs": (("log",),),
}
"""What few of those who allocate need: the rooms of each wing. A wing may import the whole core.
The fourth wing is `webapp`."""

USES: dict[str, set[str]] = {"research": {"swim"}, "logs": set()}
"""Which other wings a wing imports: experiments swim."""

VERBS = {
    "cli/app_verb": {"app"},
    "cli/eval_verbs": {"research"},
    "cli/fit_robot": {"swim"},
    "cli/log_verb": {"logs"},
    "cli/simulate": {"swim", "research"},
    "cli/train_verbs": {"research"},
}
"""Verbs that wings bring, and those wings; all else of the command line knows the core alone."""

REGISTRIES = {
    "finlab.allocation.methods": {"research"},
    "finlab.cli": set[str](),
    "finlab.cli.layout_verbs": {"swim"},
    "finlab.cli.shared_options": {"research"},
}
"""Modules outside of the wings that name what stands in these, in a string that is resolved when it
is asked for."""

LEVEL = dict[str, tuple[str, int]]()
for _name, _levels in {"core": CORE, **WINGS, "cli": (("cli",),)}.items():
    for _level, _rooms in enumerate(_levels):
        LEVEL |= dict.fromkeys(_rooms, (_name, _level))
"""Room -> its wing, and its level there."""


def _sources(package: str) -> list[Path]:
    """Files of Python in a package."""
    return sorted((ROOT / package).rglob("*.py"))


@cache
def _tree(path: Path) -> ast.Module:
    """Syntax tree of a file."""
    return ast.parse(path.read_text(encoding="utf-8"))


def _imports(path: Path) -> Iterator[tuple[str, int]]:
    """Every module that a file imports, wherever in it, with the line; those for type checkers,
    too."""
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
    """The room of a module: the longest path in the plan that it lies in; None of what is not
    ours."""
    parts = module.split(".")
    if parts[0] == "webapp":
        return "webapp"
    paths = (
        ["/".join(parts[1:end]) for end in range(len(parts), 1, -1)] if parts[0] == "finlab" else []
    )
    return next((path for path in paths if path in LEVEL), None)


def _wing(room: str) -> str:
    """The wing of a room, or the core."""
    return "app" if room == "webapp" else LEVEL[room][0]


def _module_of(path: Path, root: Path = ROOT) -> str:
    """Dotted name of a module's file."""
    parts = path.relative_to(root).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _allowed(module: str, here: str, there: str) -> bool:
    """Whether the plan has a module of one room import another room."""
    if here == there:
        return True
    own = _wing(here)
    other = _wing(there)
    if own == "cli":
        return other == "core" or other in VERBS.get(
            module.replace(".", "/").removeprefix("finlab/"), set()
        )
    if own == other:
        return LEVEL[there][1] < LEVEL[here][1]
    return own != "core" and (other == "core" or other in USES.get(own, set()))


def test_every_room_is_known() -> None:
    package = ROOT / "finlab"
    wings = [package / wing for wing in ("swim", "research")]
    paths = list(chain.from_iterable(folder.iterdir() for folder in (package, *wings)))
    rooms = {
        path.relative_to(package).with_suffix("").as_posix()
        for path in paths
        if path.suffix in ("", ".py") and path not in wings
    }
    rooms = {room for room in rooms if not room.endswith(("__init__", "__main__", "__pycache__"))}
    assert rooms == set(LEVEL), "give a new room its place in CORE or WINGS"


def test_the_core_imports_no_wing_and_all_imports_go_one_way() -> None:
    """Those in functions and for type checkers, too."""
    wrong = []
    for path in _sources("finlab"):
        module = _module_of(path)
        here = _room(module)
        if here is None:  # finlab/__init__.py and __main__.py import what the package offers
            continue
        for imported, line in _imports(path):
            there = _room(imported)
            if there is not None and not _allowed(module, here, there):
                wrong.append(f"{path.relative_to(ROOT)}:{line} imports {imported}")
    advice = (
        "CORE and WINGS say what a room may import; a verb that imports a wing has a line in VERBS"
    )
    assert not wrong, "\n".join([*wrong, advice])


def _names_of_wings(module: str, path: Path) -> Iterator[tuple[str, str]]:
    """Names of modules of another wing that stand as strings in a file which resolves such, with
    the wing."""
    here = _room(module)
    own = "door" if here is None else _wing(here)
    if "resolve_name" not in path.read_text(encoding="utf-8"):
        return
    for node in ast.walk(_tree(path)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            name = node.value.partition(":")[0]
            room = _room(name) if name.startswith(("finlab.", "webapp.")) else None
            if room is not None and _wing(room) not in ("core", "cli", own):
                yield name, _wing(room)


def test_wings_are_named_by_strings_in_registries_alone() -> None:
    named: dict[str, set[str]] = {}
    for module, path in _modules(ROOT).items():
        if not module.startswith("finlab"):
            continue
        wings = {wing for _, wing in _names_of_wings(module, path)}
        if wings:
            named[module] = wings
    assert named == {module: wings for module, wings in REGISTRIES.items() if wings}


def test_what_registries_name_is_there() -> None:
    from finlab.actuators.kinds import KINDS
    from finlab.allocation.methods import METHODS
    from finlab.cli import VERBS as COMMANDS
    from finlab.cli.layout_verbs import REMARKS
    from finlab.interaction import INTERACTIONS

    for name, method in METHODS.items():
        assert resolve_name(method).name == name
    for name, kind in KINDS.items():
        assert kind.type == name
    for name, interaction in INTERACTIONS.items():
        assert resolve_name(interaction).type == name
    assert all(callable(resolve_name(home)) for home in (*COMMANDS.values(), *REMARKS))


def _modules(root: Path) -> dict[str, Path]:
    """Every module of finlab and webapp by its full name."""
    paths = [*sorted((root / "finlab").rglob("*.py")), *sorted((root / "webapp").rglob("*.py"))]
    return {_module_of(path, root): path for path in paths}


def _import_graph(root: Path) -> "nx.DiGraph[str]":
    """Which module needs which, at once, later (in functions, or by a name given to `import_module`
    or `resolve_name`), or for types; a package's own file only where something is asked of it by
    name."""
    modules = _modules(root)
    graph: nx.DiGraph[str] = nx.DiGraph()
    for name, path in modules.items():
        text = path.read_text(encoding="utf-8")
        by_name = "import_module" in text or "resolve_name" in text
        for node in ast.walk(_tree(path)):
            wanted: list[str] = []
            if isinstance(node, ast.Import):
                wanted = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                inside = [f"{node.module}.{alias.name}" for alias in node.names]
                wanted = [full if full in modules else str(node.module) for full in inside]
            elif by_name and isinstance(node, ast.Constant) and isinstance(node.value, str):
                wanted = [node.value.partition(":")[0]]
            graph.add_edges_from((name, module) for module in wanted if module in modules)
    return graph


def _shortest_circles(graph: "nx.DiGraph[str]") -> list[list[str]]:
    """One smallest circle for each group of modules that need each other, its first module also
    last."""
    circles = []
    for group in nx.strongly_connected_components(graph):
        circles_of_group = []
        for start in group:
            for then in group.intersection(graph.successors(start)):
                circles_of_group.append([start, *nx.shortest_path(graph, then, start)])
        if circles_of_group:
            circles.append(min(circles_of_group, key=lambda circle: (len(circle), circle)))
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
        *((f"finlab/{room}", ("trimesh",)) for room in LEVEL if room != "swim/hull"),
        ("finlab/layout", ("torch", "scipy", "matplotlib")),
        ("finlab/actuators", ("torch", "scipy", "matplotlib")),
        *(
            (f"finlab/{room}", ("torch",))
            for room in ("research/evaluation", "swim/simulation", "swim/control", "exchange")
        ),
        ("webapp", ("finlab.cli",)),
        ("finlab/research/networks", ("torch", "scipy")),
    ],
)
def test_rooms_do_without(package: str, banned: tuple[str, ...]) -> None:
    door = "finlab/cli/app_verb.py"  # the one place that starts the web app
    wrong = []
    for path in _sources(package):
        if path.relative_to(ROOT).as_posix() == door:
            continue
        for module, line in _imports(path):
            if any(module == name or module.startswith(name + ".") for name in banned):
                wrong.append(f"{path.relative_to(ROOT)}:{line} imports {module}")
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
        "import finlab.allocation.dual.method, finlab.research.mdn.method, "
        "finlab.deploy.deployed_robot"
    )
    subprocess.run([sys.executable, "-c", code], timeout=60, check=True)


MOST_FILES = 50
"""Files of ours that an answer for a robot of fins loads."""


def test_allocating_loads_few_files_and_no_wing() -> None:
    code = (
        "import sys\n"
        "from finlab.cli import main\n"
        "assert main(['allocate', 'A', '--wrench', '1', '0', '0', '0', '0', '0']) == 0\n"
        "print(*(name for name, module in sys.modules.items() if getattr(module, '__file__', "
        "None)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    names = done.stdout.splitlines()[-1].split()
    ours = [name for name in names if name.partition(".")[0] in ("finlab", "webapp")]
    rooms = {_room(name) for name in ours} - {None}
    assert not [room for room in rooms if _wing(room) not in ("core", "cli")]
    assert not {"torch", "scipy", "matplotlib", "safetensors", "tqdm"} & set(names)
    kinds = {name.rpartition(".")[2] for name in ours if name.startswith("finlab.actuators.")}
    assert "fin" in kinds and not kinds & {"thruster", "azimuth", "rudder", "propeller"}
    assert len(ours) <= MOST_FILES, "\n".join(sorted(ours))
