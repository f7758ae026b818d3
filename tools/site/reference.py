"""Pages of reference, made of what the code itself says: names, commands, file formats, shipped
robots.

`hooks.py` adds them to the site. Of tests, `tests/examples/test_site.py` holds the names that have
pages; all else `make docs` alone runs.
"""

import io
import json
import re
from contextlib import redirect_stdout
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import griffe
import yaml

from finlab.cli import main

ROOT = Path(__file__).resolve().parents[2]
Pages = dict[str, str]
HEAD = "| key | value | |\n|---|---|---|\n"


@cache
def package() -> Any:
    """The library, read without importing it."""
    loader = griffe.GriffeLoader(search_paths=[str(ROOT)])
    loaded = loader.load("finlab")
    loader.resolve_aliases(implicit=True)
    return loaded


def first_line(thing: Any) -> str:
    """The first sentence of a docstring, for a table."""
    text = thing.docstring.value if thing.docstring else ""
    return re.split(r"(?<=\.)\s|\n\n", text)[0].replace("\n", " ").replace("|", r"\|")


def public(module: Any) -> dict[str, Any]:
    """What a package offers, by name: what it imports as its own name, or lists in `__all__`."""
    found = {name: module.members[name] for name in map(str, module.exports or ())}
    for home, name in re.findall(
        r"^ *from finlab\.([\w.]+) import (\w+) as \2$", module.filepath.read_text(), re.MULTILINE
    ):
        found[name] = package()[f"{home}.{name}"]  # a module may have the name of what stands in it
    return {
        name: each.final_target if each.is_alias else each for name, each in sorted(found.items())
    }


def packages(module: Any) -> list[Any]:
    """A package and those inside it, each before what it holds, in the order of their names."""
    listed = [module]
    for _, inner in sorted(module.modules.items()):
        if inner.is_init_module:
            listed += packages(inner)
    return listed


def python_pages() -> Pages:
    """A page for each package that has public names, and one for each name."""
    modules = packages(package())
    pages = {}
    index = "# Python\n\n| import from | what is there |\n|---|---|\n"
    home: dict[str, str] = {}
    for module in modules:
        names = public(module)
        if not names:
            continue
        path = module.path
        own = f"reference/python/{module.path}.md"
        pages[own] = (
            f"# {path}\n\n{module.docstring.value if module.docstring else ''}\n\n| name | "
            "|\n|---|---|\n"
        )
        index += f"| [`{path}`]({path}.md) | {first_line(module)} |\n"
        for name, thing in names.items():
            page = home.setdefault(thing.path, f"{path}.{name}")
            pages[own] += f"| [`{name}`]({page}.md) | {first_line(thing)} |\n"
            pages[f"reference/python/{page}.md"] = f"# {page}\n\n::: {thing.path}\n"
    return {"reference/python/index.md": index, **pages}


def command_pages() -> Pages:
    """A page for each verb of the command line, with its help and that of what stands below it."""
    index = f"# Command line\n\n```text\n{help_of()}\n```\n"
    verbs = below(help_of())
    pages = {f"reference/commands/{verb}.md": _sections((verb,)) for verb in verbs}
    return {"reference/commands/index.md": index + _rows(verbs), **pages}


def _sections(words: tuple[str, ...]) -> str:
    text = help_of(*words)
    own = f"{'#' * len(words)} finlab {' '.join(words)}\n\n```text\n{text}\n```\n\n"
    return own + "".join(_sections((*words, verb)) for verb in below(text))


def _rows(verbs: list[str]) -> str:
    return "\n" + "".join(f"- [`finlab {verb}`]({verb}.md)\n" for verb in verbs)


def below(text: str) -> list[str]:
    """The verbs below one, as its help names them."""
    found = re.search(r"^usage: [^{]*\[-h\] \{([\w,]+)\}", text)
    return found.group(1).split(",") if found else []


def help_of(*words: str) -> str:
    """The help of a verb."""
    out = io.StringIO()
    with redirect_stdout(out), patch.dict("os.environ", COLUMNS="100"):
        main([*words, "--help"])
    return "\n".join(line.rstrip() for line in out.getvalue().splitlines())


def format_pages() -> Pages:
    """A page for each file format that has a JSON Schema: its parts, with their keys."""
    pages = {}
    for name in ("layout", "graph"):
        schema = json.loads((ROOT / f"finlab/layout/{name}.schema.json").read_text())
        text = (
            f"# The {name} file\n\nMade of its JSON Schema, `finlab/layout/{name}.schema.json`.\n"
        )
        pages[f"reference/formats/{name}-file.md"] = text + "".join(
            f"\n## {part}\n\n{about.get('description', '')}\n\n{HEAD}{_keys(part, about)}"
            for part, about in schema["$defs"].items()
        )
    return pages


def _keys(part: str, about: dict[str, Any]) -> str:
    row = "| `{}`{} | {} | {} |\n"
    must = about.get("required", [])
    meaning = _meanings(part)
    return "".join(
        row.format(
            key, " (required)" * (key in must), _value(of), of.get("description") or meaning(key)
        )
        for key, of in about.get("properties", {}).items()
    )


def _meanings(part: str) -> Any:
    """From a key to what the class of that name says of it; a key has its unit behind the name."""
    said = classes(package()).get(part, {})
    return lambda key: next(
        (said[name] for name in sorted(said, key=len, reverse=True) if key.startswith(name)), ""
    )


@cache
def classes(module: Any) -> dict[str, dict[str, str]]:
    """What the classes of a module, and of those within it, say of their attributes: in the
    docstrings below them, or under Args in the docstring of the class."""
    found = {}
    for each in module.members.values():
        # An imported name is read where it is defined, and griffe cannot say what an alias is
        # whose target lies outside of the package.
        if each.is_alias:
            continue
        if each.is_class:
            found[each.name] = {name: first_line(own) for name, own in each.attributes.items()}
            found[each.name] |= _arguments(each)
        elif each.is_module:
            found |= classes(each)
    return found


def _arguments(made: Any) -> dict[str, str]:
    """Arguments of a class with what its docstring says of each, as a sentence."""
    if made.docstring is None:
        return {}
    arguments = {}
    for section in made.docstring.parse("google"):
        if section.kind is griffe.DocstringSectionKind.parameters:
            for argument in section.value:
                meaning = " ".join(argument.description.split()).replace("|", r"\|")
                arguments[argument.name] = meaning[:1].upper() + meaning[1:]
    return arguments


def _value(of: dict[str, Any]) -> str:
    """What a key may be, in words."""
    if "$ref" in of:
        name = of["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})"
    if "anyOf" in of:
        return " or ".join(_value(each) for each in of["anyOf"] if each != {"type": "null"})
    if "enum" in of:
        return " or ".join(f"`{each}`" for each in of["enum"])
    if "prefixItems" in of:
        parts = [_value(each) for each in of["prefixItems"]]
        return f"{len(parts)} times {parts[0]}" if len(set(parts)) == 1 else f"[{', '.join(parts)}]"
    if of.get("type") == "array":
        return f"list of {_value(of.get('items') or {})}"
    low, high = (of.get(key) for key in ("minimum", "maximum"))
    bounds = f", {low:g} to {high:g}" if low is not None and high is not None else ""
    return f"{of.get('type', 'any value')}{bounds}"


def robots_page() -> Pages:
    """The robots that come along, with their files."""
    text = (
        "# Robots that come along\n\n`finlab.load_layout(NAME)`, or NAME where a command asks for "
        "a layout.\n"
    )
    for path in sorted((ROOT / "layouts").glob("*.yaml")):
        source = path.read_text(encoding="utf-8")
        about = str(yaml.safe_load(source).get("description") or "").strip()
        text += f'\n## {path.stem}\n\n{about}\n\n??? note "layouts/{path.name}"\n\n    ```yaml\n'
        text += "".join(f"    {line}\n" for line in source.splitlines()) + "    ```\n"
    return {"reference/robots.md": text}
