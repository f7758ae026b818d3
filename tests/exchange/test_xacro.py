"""Descriptions that xacro expands: ordinary ones work, a stranger's run nothing and open no
files."""

import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import pytest

from finlab.cli import main
from finlab.errors import LayoutError
from finlab.exchange import Exchange, read_any, read_robot
from finlab.exchange.expressions import evaluate
from finlab.exchange.xacro_files import SECONDS
from finlab.layout import Layout, load_layout
from tests.terminal import refused

pytest.importorskip("xacro")

MARK = "code_ran"
"""The file that hostile descriptions make."""
HULL = (
    '<link name="hull"><inertial><mass value="12"/>'
    '<inertia ixx="0.2" iyy="0.3" izz="0.3" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
"""A link with a mass and an inertia."""


def screw(name: str, place: str) -> str:
    """A thruster that pushes forward."""
    return (
        f'<link name="{name}"/><joint name="j{name}" type="continuous"><parent link="hull"/>'
        f'<child link="{name}"/><origin xyz={quoteattr(place)}/><axis xyz="1 0 0"/></joint>'
        '<gazebo><plugin filename="gz-sim-thruster-system" name="gz::sim::systems::Thruster">'
        f"<joint_name>j{name}</joint_name></plugin></gazebo>"
    )


def robot(*parts: str) -> str:
    """A description with a hull, and what else is given."""
    start = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="skiff">'
    return f"{start}{HULL}{''.join(parts)}</robot>"


def write(folder: Path, text: str, name: str = "a.urdf") -> str:
    """Write a description, and return its path."""
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return str(path)


def sentence_of(file: str) -> str:
    """The sentence by which a file is refused in this process, and the same at the command line."""
    with pytest.raises(LayoutError) as caught:
        read_any(file, Exchange())
    sentence = str(caught.value)
    assert refused(["layout", "convert", file, "out.yaml"]) == f"finlab: error: {sentence}\n"
    assert sentence.startswith(f"{file}: ") and "\n" not in sentence
    assert "memory" not in sentence and "limit" not in sentence
    return sentence


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of the descriptions, where none may have made a file."""
    home = tmp_path / "home"
    home.mkdir()
    monkeypatch.chdir(home)
    yield home
    assert not list(tmp_path.rglob(MARK))


ALL_CLASSES = "().__class__.__base__.__subclasses__()"
"""An expression that reaches all classes of Python, by which sandboxes are left."""
HOSTILE_EXPRESSIONS = [
    f"(lambda: [c for c in {ALL_CLASSES} if c.__name__ == '_wrap_close'][0]"
    f".__init__.__globals__['system']('touch {MARK}'))() or 10",
    f"__import__('os').system('touch {MARK}')",
    ALL_CLASSES,
    "''.__class__",
    "pi.__class__.__mro__[1]",
    "(1).real",
    "'a'.upper()",
    "lambda: 1",
    "(lambda: 1)()",
    "[c for c in (1, 2)][0]",
    "list(c for c in (1, 2))",
    "len((1,).__class__.__bases__)",
    "[(lambda f: f)(c) for c in [1]][0]",
    "f'{1}'",
    "f'{().__class__}'",
    "'{0.__class__}'.format(1)",
    "'%s' % 1",
    "'{0.__init__.__globals__}'.format(len)",
    "getattr(1, 'real')",
    "getattr((), '__cl' + 'ass__')",
    "vars()",
    "type(1)",
    "python.type('X', (), [])",
    "python.vars(math)",
    "map(float, '1')",
    f"open('{MARK}', 'w')",
    f'eval(\'open("{MARK}", "w")\')',
    f'exec(\'open("{MARK}", "w")\')',
    "compile('1', 'a', 'eval')",
    "(x := 1)",
    "max(*[1, 2])",
    "max([1, 2], key=len)",
    "dict(**[])",
    "[*[1, 2]][0]",
    "len",
    "math.sin",
    "xacro.load_yaml",
    "[abs][0](1)",
    "(abs or len)(1)",
    "abs.__self__",
    "math.__loader__",
    "xacro.__dict__",
    "__builtins__",
    "hull.__class__",
    "1 if True else __import__('os')",
    "1 or __import__('os')",
    "True or [].append(1)",
    "b'bytes'",
    "1j",
    "...",
    "~1",
    "1 << 99",
    "await_ if 0 else (yield)",
    "import os",
    "1; 2",
    "",
    "9**9**9",
    "9**-9**9**9",
    "10**100**100",
    "(-1)**0.5",
    "'a' * 10**9",
    "[0] * 10**9",
    "[[[0] * 999] * 999] * 999",
    "round(1, -10**9)",
    "range(10**9)",
    "int('9' * 4000)",
    "(" * 999,
    "-" * 1999 + "1",
    "1+" * 1200 + "1",
]
"""Expressions that leave what xacro may evaluate; some would create the file `MARK`."""


@pytest.mark.parametrize("expression", HOSTILE_EXPRESSIONS)
def test_a_hostile_expression_is_a_sentence(folder: Path, expression: str) -> None:
    part = f"<link name={quoteattr('a${' + expression + '}')}/>"
    sentence = sentence_of(write(folder, robot(screw("s", "-1 0 0"), part)))
    assert "${" in sentence


CODE = f"${{(lambda: [c for c in {ALL_CLASSES}][0])()}}"
"""One of them, as xacro writes an expression."""
EVAL = "$(eval [].__class__)"
"""The same in the older form of `$(eval ...)`."""
DESCRIPTIONS_WITH_CODE = {
    "text": "<gazebo><a>CODE</a></gazebo>",
    "property": '<xacro:property name="p" value="CODE"/><link name="a${p}"/>',
    "property of a property": '<xacro:property name="p" value="CODE"/><xacro:property name="q" '
    'value="${p}"/><link name="a${q}"/>',
    "property at once": '<xacro:property name="p" value="CODE" lazy_eval="false"/>',
    "property of the caller": '<xacro:property name="p" value="CODE" scope="global"/>',
    "default of a property": '<xacro:property name="p" default="CODE"/><link name="a${p}"/>',
    "name of a property": '<xacro:property name="CODE" value="1"/>',
    "remove of a property": '<xacro:property name="p" remove="CODE"/>',
    "default of a macro": '<xacro:macro name="m" params="p:=CODE"><a b="${p}"/></xacro:macro><xacro:m/>',
    "forwarded default": '<xacro:macro name="m" params="p:=^|CODE"><a b="${p}"/></xacro:macro><xacro:m/>',
    "argument of a macro": '<xacro:macro name="m" params="p"><link name="a${p}"/></xacro:macro>'
    '<xacro:m p="CODE"/>',
    "block": '<xacro:macro name="m" params="*b"><xacro:insert_block name="b"/></xacro:macro>'
    '<xacro:m><link name="CODE"/></xacro:m>',
    "if": '<xacro:if value="CODE"><link name="a"/></xacro:if>',
    "unless": '<xacro:unless value="CODE"><link name="a"/></xacro:unless>',
    "arg": '<xacro:arg name="p" default="CODE"/>',
    "call": '<xacro:call macro="CODE"/>',
    "element": '<xacro:element xacro:name="CODE"/>',
    "attribute": '<link name="a"><xacro:attribute name="b" value="CODE"/></link>',
    "include": '<xacro:include filename="CODE"/>',
    "namespace": '<xacro:include filename="a.urdf" ns="CODE"/>',
    "comment": '<!-- xacro:eval-comments --><!-- CODE --><link name="${1}"/>',
    "eval": f'<link name="{EVAL}"/>',
    "eval in an expression": f"<link name=\"${{'{EVAL}'}}\"/>",
    "eval that calls": "<link name=\"$(eval env('HOME')\"/>",
}
"""Where in a description an expression may stand -> that description."""


@pytest.mark.parametrize("place", DESCRIPTIONS_WITH_CODE)
def test_expressions_are_judged_wherever_they_stand(folder: Path, place: str) -> None:
    text = DESCRIPTIONS_WITH_CODE[place].replace("CODE", CODE)
    sentence = sentence_of(write(folder, robot(screw("s", "-1 0 0"), text)))
    assert "expected" in sentence


def test_an_expression_that_is_escaped_stays_text(folder: Path) -> None:
    text = f'<xacro:property name="p" value="${CODE}"/><link name="a${{p}}"/>'
    assert read_any(write(folder, robot(screw("s", "-1 0 0"), text)), Exchange()).n == 1


def test_an_expression_in_an_included_file_is_judged_there(folder: Path) -> None:
    write(folder, f'<robot><link name="{CODE}"/></robot>', "parts/b.xacro")
    text = robot('<xacro:include filename="parts/b.xacro"/>')
    assert "in b.xacro: ${" in sentence_of(write(folder, text))


@pytest.mark.parametrize(
    ("part", "said"),
    [
        ('<link name="$(env HOME)"/>', r"\$\(env HOME\) reads the environment"),
        ('<link name="$(optenv HOME a)"/>', "reads the environment"),
        ('<link name="$(dirname)"/>', "asks for a folder of this computer"),
        ('<link name="$(cwd)"/>', "asks for a folder of this computer"),
        ('<link name="$(find ../a)"/>', "is no substitution"),
        ('<link name="$(anon a)"/>', "is no substitution"),
        ('<link name="$(arg a)"/>', "has no value for argument 'a'"),
        ("<link name=\"${xacro.load_yaml('a.urdf')}\"/>", "calls xacro.load_yaml, which opens"),
        ("<link name=\"${load_yaml('../secret.xacro')['a']}\"/>", "calls load_yaml, which opens"),
        ("<link name=\"${xacro.abs_filename('a')}\"/>", "calls xacro.abs_filename, which opens"),
        ('<xacro:include filename="../secret.xacro"/>', "includes '../secret.xacro', a file"),
        ('<xacro:include filename="OUTSIDE/secret.xacro"/>', "a file elsewhere"),
        ('<xacro:include filename="/etc/passwd"/>', "includes '/etc/passwd', a file elsewhere"),
        ('<xacro:include filename="a.urdf/../../secret.xacro"/>', "a file elsewhere"),
        ('<xacro:include filename="link.xacro"/>', "includes 'link.xacro', a file elsewhere"),
        ('<xacro:include filename="folder/secret.xacro"/>', "a file elsewhere"),
        ('<xacro:include filename="$(find b)/c.xacro"/>', r"includes '\$\(find b\)/c.xacro', a"),
        ('<xacro:include filename="*.xacro"/>', "a pattern"),
        (
            '<xacro:include filename="none.xacro"/>',
            "includes 'none.xacro', and there is no such file",
        ),
        ('<xacro:include filename="a.urdf"/>', "nested too deep"),
        ('<xacro:include filename="entity.xacro"/>', "declares a DOCTYPE or entities"),
        ('<xacro:include filename="pipe.xacro"/>', "no such file"),
        ("<link name=\"${xacro.fatal('use', 2)}\"/>", "the description cannot be used: use 2"),
    ],
)
def test_no_file_elsewhere_and_no_environment(folder: Path, part: str, said: str) -> None:
    secret = folder.parent / "secret.xacro"
    secret.write_text("<robot><link name='secret'/></robot>")
    (folder / "link.xacro").symlink_to(secret)
    (folder / "folder").symlink_to(folder.parent)
    (folder / "entity.xacro").write_text("<!DOCTYPE a [<!ENTITY b 'c'>]><robot>&b;</robot>")
    os.mkfifo(folder / "pipe.xacro")
    part = part.replace("OUTSIDE", str(folder.parent))
    file = write(folder, robot(screw("s", "-1 0 0"), part))
    with pytest.raises(LayoutError, match=said):
        read_any(file, Exchange())
    sentence_of(file)


MANY_LINKS = '<link name="${1}"/>' * 2000
"""Two thousand links."""
DOUBLING_MACRO = '<xacro:macro name="mNEXT" params=""><xacro:mTHIS/><xacro:mTHIS/></xacro:macro>'
"""A macro that expands another one twice."""
DOUBLING_MACROS = "".join(
    DOUBLING_MACRO.replace("NEXT", str(i + 1)).replace("THIS", str(i)) for i in range(40)
)
"""Forty of these: a description of 2^40 links."""
DOUBLING_PROPERTY = '<xacro:property name="pNEXT" value="${pTHIS}${pTHIS}"/>'
"""A property that holds another one twice."""
DOUBLING_PROPERTIES = "".join(
    DOUBLING_PROPERTY.replace("NEXT", str(i + 1)).replace("THIS", str(i)) for i in range(60)
)
"""Sixty of these: a text of 2^60 times its length."""


@pytest.mark.parametrize(
    "part",
    [
        '<xacro:macro name="m" params=""><link name="${1}"/><xacro:m/></xacro:macro><xacro:m/>',
        f'<xacro:macro name="m" params="">{MANY_LINKS}<xacro:m/></xacro:macro><xacro:m/>',
        f'{DOUBLING_MACROS}<xacro:macro name="m0" params=""><link name="a"/></xacro:macro><xacro:m40/>',
        f'<xacro:property name="p"><g>{MANY_LINKS}<xacro:insert_block name="p"/>'
        '<xacro:insert_block name="p"/></g></xacro:property><xacro:insert_block name="p"/>',
        f'{DOUBLING_PROPERTIES}<xacro:property name="p0" value="a b"/><link name="${{p60}}"/>',
        '<xacro:property name="p" value="${q}"/><xacro:property name="q" value="${p}"/><link name="${p}"/>',
        '<xacro:macro name="m" params="n"><link name="l${n}"/><xacro:if value="${n > 0}">'
        '<xacro:m n="${n - 1}"/></xacro:if></xacro:macro>' + '<xacro:m n="80"/>' * 200,
        '<xacro:macro name="m" params="' + "a:=1 " * 100_000 + '"/>',
        '<link name="' + "$a" * 300_000 + '"/><link name="${1}"/>',
        '<xacro:property name="' + "-" * 900_000 + '" value="1"/>',
        "<!--a-->" * 100_000 + '<xacro:property name="p" value="${1}"/>',
        "<?a?>" * 100_000 + '<xacro:property name="p" value="${1}"/>',
        '<link name="${' + "sum(" + "+".join(["[1] * 9"] * 100) + ')}"/>' + MANY_LINKS * 8,
    ],
    ids=range(13),
)
def test_what_grows_without_end_ends_soon(folder: Path, part: str) -> None:
    file = write(folder, robot(screw("s", "-1 0 0"), part))
    start = time.thread_time()
    with pytest.raises(LayoutError):
        read_any(file, Exchange())
    # The limit is looked at between elements, and what is beside the expansion takes time, too.
    assert time.thread_time() - start < 2.5 * SECONDS
    # A process that reads it has room for 150 MB, and would say so.
    assert "too much" not in refused(["layout", "convert", file, "out.yaml"])


def test_a_macro_with_a_quote_without_end_is_read_in_linear_time(folder: Path) -> None:
    macro = '<xacro:macro name="m" params="p:=' + "x" * 5000 + "'\"/>"
    start = time.thread_time()
    assert read_any(write(folder, robot(screw("s", "${-1} 0 0"), macro)), Exchange()).n == 1
    assert time.thread_time() - start < 1.0


def both(file: str) -> Layout:
    """The layout in a description, read in this process and at the command line."""
    assert main(["layout", "convert", file, "out.yaml"]) == 0
    layout = read_any(file, Exchange())
    assert [part.name for part in load_layout("out.yaml").actuators] == [
        part.name for part in layout.actuators
    ]
    return layout


ORDINARY_DESCRIPTIONS = {
    "property": (
        '<xacro:property name="half" value="0.3"/>'
        + screw("l", "-0.5 ${half} 0")
        + screw("r", "-0.5 ${-half} 0"),
        [(-0.5, 0.3, 0), (-0.5, -0.3, 0)],
    ),
    "arithmetic": (
        screw("a", "${-pi/2} ${radians(30)} ${2**-1}")
        + screw("b", "${math.pi} ${sqrt(4) % 3} ${7 // 2}"),
        [(-np.pi / 2, np.pi / 6, 0.5), (np.pi, 2, 3)],
    ),
    "macro with defaults": (
        '<xacro:macro name="screw" params="name x:=-0.5 y:=${0.1 * 2} *shape">'
        + screw("${name}_link", "${x} ${y} 0").replace(
            "<gazebo>", '<xacro:insert_block name="shape"/><gazebo>'
        )
        + '</xacro:macro><xacro:screw name="l"><a/></xacro:screw>'
        '<xacro:screw name="r" y="${-0.2}"><a/></xacro:screw>',
        [(-0.5, 0.2, 0), (-0.5, -0.2, 0)],
    ),
    "conditions": (
        '<xacro:arg name="heavy" default="true"/><xacro:arg name="side" default="left"/>'
        '<xacro:property name="flag" value="$(arg heavy)"/>'
        '<xacro:if value="${flag and not False}">' + screw("a", "-1 0 0") + "</xacro:if>"
        '<xacro:unless value="$(arg heavy)">' + screw("b", "-2 0 0") + "</xacro:unless>"
        "<xacro:if value=\"${xacro.arg('side') == 'left'}\">" + screw("c", "-3 0 0") + "</xacro:if>"
        "<xacro:if value=\"${'$(arg side)' in ['right']}\">" + screw("d", "0 0 0") + "</xacro:if>",
        [(-1, 0, 0), (-3, 0, 0)],
    ),
    "lists and mappings": (
        '<xacro:property name="size" value="${dict(x=-0.5, ys=[0.1, 0.2], z=0.3)}"/>'
        + screw("a", "${size['x']} ${size['ys'][1]} ${size.z}")
        + screw("b", "${size['x']} ${max(size['ys'] + [0])} ${min(1, len(size['ys']))}"),
        [(-0.5, 0.2, 0.3), (-0.5, 0.2, 1)],
    ),
    "loop": (
        '<xacro:macro name="row" params="n">' + screw("s${n}", "-${n} ${0.5 if n > 1 else -0.5} 0")
        + '<xacro:if value="${n > 1}"><xacro:row n="${n - 1}"/></xacro:if></xacro:macro>'
        '<xacro:row n="3"/>',
        [(-3, 0.5, 0), (-2, 0.5, 0), (-1, -0.5, 0)],
    ),
    "old expressions": (
        '<xacro:arg name="n" default="2"/>'
        + screw("$(arg n)a", "$(eval -n * 0.5) $(eval n/4.0) 0"),
        [(-1, 0.5, 0)],
    ),
    "files below": (
        '<xacro:include filename="parts/screws.xacro" ns="parts"/>'
        '<xacro:include filename="none.xacro" optional="true"/>'
        '<xacro:parts.screw x="${parts.place}"/><link name="m"><visual><geometry>'
        '<mesh filename="file://$(find boat)/mesh.stl"/></geometry></visual></link>',
        [(-0.7, 0, 0)],
    ),
    "files of the own package": (
        '<xacro:include filename="$(find home)/parts/screws.xacro"/><xacro:screw x="${place}"/>',
        [(-0.7, 0, 0)],
    ),
}  # fmt: skip
"""Feature of xacro -> a description that uses it, and where its thrusters are."""


@pytest.mark.parametrize("kind", ORDINARY_DESCRIPTIONS)
def test_ordinary_descriptions_work(folder: Path, kind: str) -> None:
    text, places = ORDINARY_DESCRIPTIONS[kind]
    inside = '<xacro:include filename="../parts/macro.xacro"/>'
    place = '<xacro:property name="place" value="-0.7"/>'
    write(folder, f'<robot xmlns:xacro="x">{place}{inside}</robot>', "parts/screws.xacro")
    macro = f'<xacro:macro name="screw" params="x">{screw("s", "${x} 0 0")}</xacro:macro>'
    write(folder, f'<robot xmlns:xacro="x">{macro}</robot>', "parts/macro.xacro")
    layout = both(write(folder, robot(text), "a.urdf.xacro"))
    assert layout.body is not None and layout.body.mass_kg == 12
    np.testing.assert_allclose([part.position for part in layout.actuators], places, atol=1e-9)


def test_a_description_without_a_path_is_not_expanded() -> None:
    with pytest.raises(LayoutError, match="is a xacro file, .* `finlab layout convert` expands it"):
        read_robot(robot(screw("s", f"{CODE} 0 0")), "a.urdf", Exchange())


def test_it_changes_nothing_for_others_who_use_xacro(folder: Path) -> None:
    import xacro

    file = write(folder, robot(screw("s", "${-1} 0 0")))
    evaluate = xacro.safe_eval
    symbols = dict(xacro._global_symbols)
    read_any(file, Exchange())
    assert xacro.safe_eval is evaluate and dict(xacro._global_symbols) == symbols


def test_another_xacro_is_not_trusted(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    other = folder / "other"
    other.mkdir()
    (other / "xacro.py").write_text("def process_doc(document): pass")
    monkeypatch.syspath_prepend(str(other))
    monkeypatch.delitem(sys.modules, "xacro", raising=False)
    file = write(folder, robot(screw("s", "${-1} 0 0")))
    with pytest.raises(LayoutError, match=r"has no safe_eval: pip install xacro==2\.1\.1"):
        read_any(file, Exchange())


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("1 + 2 * 3 - -4", 11),
        ("7 % 4 // 2 / 1", 1.0),
        ("2 ** 10", 1024),
        ("2 < 3 <= 3 != 4", True),
        ("not 0 and 'a' or 'b'", "a"),
        ("0 or None or ''", ""),
        ("'a' + 'b' * 2", "abb"),
        ("[1, 2, 3][-1]", 3),
        ("'abc'[1:]", "bc"),
        ("{'a': [1, (2, 3)]}['a'][1]", (2, 3)),
        ("1 if 'a' not in 'b' else 1 / 0", 1),
        ("math.atan2(0, 1) + python.abs(-2)", 2.0),
        ("round(2.6, 0) / round(2.6)", 1.0),
        ("round(2.345, 2) + int('3') + float('1e3')", 1005.35),
        ("[0] + range(3)", [0, 0, 1, 2]),
        ("str(x) + '_link'", "5_link"),
        ("x is None", False),
        ("box.depth.water", 3),
    ],
)
def test_what_expressions_give(expression: str, value: object) -> None:
    names = {"x": 5, "box": {"depth": {"water": 3}}}
    assert evaluate(expression, names.__getitem__, names.__getitem__) == value
