"""The imports between the files of the tree, read from their sources.

`tools/near_tests.py` measures by them how near a test is to a change. A file is known by its path
from the top of the tree, such as `finlab/layout/damage.py`; edges go from a file to what it
imports. Dependencies that no import statement names are edges, too:

- a name that a package only passes on leads to the file that defines it: `from finlab import
  Allocator` to `finlab/allocation/allocator.py`. The package's file itself passes nothing on;
- a module that is loaded by name, where its full name stands as a string, as in registries
  (`module:Class`);
- a fixture, by the name of an argument, leads to its `conftest.py`;
- `finlab/core/__init__.py` loads what is compiled from the C files, and a Python file that shares
  its name with a C file does the same work or calls it.
"""

import ast
from collections import defaultdict, deque
from collections.abc import Iterable
from functools import cache, cached_property
from pathlib import Path

ROOMS = {"finlab": "", "webapp": "", "tests": "", "ros2/finlab_allocator": "ros2/finlab_allocator"}
"""Folders whose Python files are in the graph, each with the folder that the names of its modules
begin in: of most the top of the tree."""
CORE = "finlab/core/"
"""The folder of the C files."""
LOADER = "finlab/core/__init__.py"
"""The file that loads the compiled core."""
PASSES_NAMES_ON = {"__getattr__", "__dir__"}
"""Functions of a package's `__init__.py` that only passes names on."""


class ImportGraph:
    """The imports of a tree."""

    def __init__(self, root: Path) -> None:
        """Reads the Python files of a tree.

        Args:
            root: the top of the tree.

        Raises:
            SyntaxError: a file is no Python.
        """
        self.root = root
        self.trees: dict[str, ast.Module] = {}
        self.file_of: dict[str, str] = {}
        for room, start in ROOMS.items():
            for path in sorted((root / room).rglob("*.py")):
                inside = path.relative_to(root / start).with_suffix("")
                module = ".".join(inside.parts).removesuffix(".__init__")
                file = path.relative_to(root).as_posix()
                self.file_of[module] = file
                self.trees[file] = ast.parse(path.read_text(encoding="utf-8"))
        core = sorted((root / CORE).rglob("*"))
        self.c_files = [
            path.relative_to(root).as_posix() for path in core if path.suffix in (".c", ".h")
        ]

    @cached_property
    def importers(self) -> dict[str, set[str]]:
        """Files that import a file, by the file."""
        importers = defaultdict[str, set[str]](set)
        for file in self.trees:
            for imported in self.imports(file):
                importers[imported].add(file)
        for c_file in self.c_files:
            importers[c_file].add(LOADER)
            stem = Path(c_file).stem
            namesakes = {file for file in self.trees if Path(file).stem in (stem, f"test_{stem}")}
            importers[c_file] |= {
                file for file in namesakes if not file.startswith(("webapp", "tests/webapp"))
            }
        return importers

    def distances(self, changed: Iterable[str]) -> dict[str, int]:
        """Returns how many imports lie between each file and the nearest changed one.

        What tests share counts as a part of the test: an import of a helper in `tests` adds
        nothing. Files that no changed one reaches are left out.

        Args:
            changed: the changed files.
        """
        distances = dict.fromkeys(changed, 0)
        queue = deque(distances)
        while queue:
            file = queue.popleft()
            step = 0 if file.startswith("tests/") else 1
            for importer in self.importers.get(file, ()):
                distance = distances[file] + step
                if distance < distances.get(importer, distance + 1):
                    distances[importer] = distance
                    (queue.append if step else queue.appendleft)(importer)
        return distances

    def imports(self, file: str) -> set[str]:
        """Files that a file imports, itself left out."""
        tree = self.trees[file]
        if file.endswith("__init__.py") and self._only_passes_on(tree):
            return set()
        files = set[str]()
        arguments = set[str]()
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                for alias in node.names:
                    files |= self._file_of_module(alias.name)
            elif isinstance(node, ast.ImportFrom) and node.module:
                for alias in node.names:
                    files |= self._files_of_name(node.module, alias.name)
            elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                if node.value.id in self.file_of:  # `finlab.Allocator` after `import finlab`
                    files |= self._files_of_name(node.value.id, node.attr)
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                files |= self._files_of_string(node.value)
            elif isinstance(node, ast.arg):
                arguments.add(node.arg)
        if file.startswith("tests/"):
            files |= self._conftests(file, arguments)
        return files - {file}

    def _file_of_module(self, module: str) -> set[str]:
        """The file of a module; empty for one of other packages."""
        return {self.file_of[module]} if module in self.file_of else set()

    def _files_of_name(self, module: str, name: str) -> set[str]:
        """Files that `from module import name` needs: the module, and where it only passes the name
        on, the file that defines it."""
        files = self._file_of_module(module) | self._file_of_module(f"{module}.{name}")
        if module not in self.file_of or f"{module}.{name}" in self.file_of:
            return files
        source = self._passed_on(self.file_of[module]).get(name)
        return files | self._files_of_name(source, name) if source else files

    @cache  # noqa: B019 - one graph, one process
    def _passed_on(self, file: str) -> dict[str, str]:
        """The names that a package's file imports, and from which module."""
        if not file.endswith("__init__.py"):
            return {}
        nodes = [node for node in ast.walk(self.trees[file]) if isinstance(node, ast.ImportFrom)]
        modules = dict[str, str]()
        for node in nodes:
            modules |= {alias.name: str(node.module) for alias in node.names}
        return modules

    def _files_of_string(self, text: str) -> set[str]:
        """Files of a string that is a module's full name, alone or before a colon and the name of
        something in it, as in registries; of one that ends in a dot, such as the beginning of
        `f"finlab.cli.{verb}"`, all modules in that package."""
        module, _, _ = text.partition(":")
        if not text.startswith(("finlab.", "webapp.")):
            return set()
        if text.endswith("."):
            return {
                path for name, path in self.file_of.items() if name.rpartition(".")[0] == text[:-1]
            }
        return self._file_of_module(module)

    @staticmethod
    def _only_passes_on(tree: ast.Module) -> bool:
        """Whether a package's file defines no function of its own."""
        functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
        return functions <= PASSES_NAMES_ON

    def _conftests(self, file: str, arguments: set[str]) -> set[str]:
        """The files of fixtures that a test file's arguments name."""
        conftests = set[str]()
        for folder in Path(file).parents:
            conftest = f"{folder.as_posix()}/conftest.py"
            body = self.trees[conftest].body if conftest in self.trees else []
            if any(isinstance(node, ast.FunctionDef) and node.name in arguments for node in body):
                conftests.add(conftest)
        return conftests
