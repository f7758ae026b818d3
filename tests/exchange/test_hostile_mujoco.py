"""Hostile models of MuJoCo: one sentence, no file elsewhere, no more than 2 s and 300 MB."""

import os
import re
import resource
import time
from pathlib import Path

import pytest

from finlab.errors import FinlabError, LayoutError
from finlab.exchange import Exchange, read_any, read_robot
from finlab.files.worker import in_worker

SECONDS = 2.0
"""Most processor time that a file may take [s]."""
BYTES = 200_000_000
"""Most memory that reading it may take [bytes], beside what the process has before."""
SECRET = "the secret of another folder"
"""What stands in a file elsewhere."""


def model(inside: str = "", actuators: str = "", head: str = "") -> str:
    """A model with a hull and a site, and what else is given."""
    return (
        f'<mujoco>{head}<worldbody><body name="hull"><freejoint/><inertial pos="0 0 0" mass="12" '
        f'diaginertia="1 1 1"/><site name="s"/>{inside}</body></worldbody><actuator>'
        f'<motor name="m" site="s" gear="0 0 1"/>{actuators}</actuator></mujoco>'
    )


def nested(count: int) -> str:
    """Bodies in bodies."""
    return "<body>" * count + "</body>" * count


HOSTILE = {
    "include above": (model(head='<include file="../secret.xml"/>'), "a file elsewhere"),
    "include absolute": (model(head='<include file="{secret}"/>'), "a file elsewhere"),
    "include by a link": (model(head='<include file="link.xml"/>'), "a file elsewhere"),
    "include of itself": (model(head='<include file="robot.xml"/>'), "twice, or from itself"),
    "include twice": (
        model(head='<include file="part.xml"/><include file="part.xml"/>'),
        "twice, or from itself",
    ),
    "includes in a circle": (model(head='<include file="circle.xml"/>'), "twice, or from itself"),
    "include of a folder": (model(head='<include file="."/>'), "no such file"),
    "include of a device": (model(head='<include file="/dev/zero"/>'), "a file elsewhere"),
    "include of a pipe": (model(head='<include file="pipe.xml"/>'), "no such file"),
    "include of nothing": (model(head="<include/>"), "no such file|a file elsewhere"),
    "include of a NUL": (model(head='<include file="a&#0;b"/>'), "not readable XML"),
    "include of no XML": (model(head='<include file="text.xml"/>'), "not readable XML"),
    "entities": (
        '<!DOCTYPE m [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;">]>' + model("&b;"),
        "DOCTYPE or entities",
    ),
    "entity of a file": (
        '<!DOCTYPE m [<!ENTITY a SYSTEM "../secret.xml">]>' + model("&a;"),
        "DOCTYPE or entities",
    ),
    "deep": (model(nested(5000)), "deeper than 100"),
    "deep by includes": (model('<include file="deep.xml"/>'), "deeper than 100"),
    "deep defaults": (model(head="<default>" * 5000 + "</default>" * 5000), "deeper than 100"),
    "many bodies": (model("<body/>" * 100_000), "more than 20,000 parts"),
    "many sites": (model("".join(f'<site name="x{i}"/>' for i in range(50_000))), "20,000 parts"),
    "many elements": (model("<a/>" * 300_000), "over 200,000 elements"),
    "many motors": (
        model(actuators="".join(f'<motor name="n{i}" site="s"/>' for i in range(30_000))),
        "256",
    ),
    "many classes": (
        model(head="".join(f'<default class="c{i}"><geom/></default>' for i in range(30_000))),
        "",
    ),
    "long number": (model('<site name="t" pos="' + "9" * 1_000_000 + ' 0 0"/>'), "not 3 numbers"),
    "many numbers": (model('<site name="t" pos="' + "1 " * 1_000_000 + '"/>'), "not 3 numbers"),
    "NaN place": (model('<site name="t" pos="nan 0 0"/>'), "not 3 numbers of ordinary size"),
    "infinite gear": (model(actuators='<motor site="s" gear="inf"/>'), "not 6 numbers of ordin"),
    "NaN mass": (
        model('<body><inertial pos="0 0 0" mass="nan" diaginertia="1 1 1"/></body>'),
        "not a number of ordinary size",
    ),
    "negative mass": (
        model('<body><inertial pos="0 0 0" mass="-50" diaginertia="1 1 1"/></body>'),
        "no mass",
    ),
    "huge range": (model(actuators='<motor site="s" ctrlrange="-1e300 1e300"/>'), "not 2 numbers"),
    "range that falls": (model(actuators='<motor site="s" ctrlrange="2 1"/>'), "one that rises"),
    "force that cannot stop": (
        model(actuators='<motor site="s" ctrlrange="1 2"/>'),
        "cannot stop: its force goes from 1 to 2",
    ),
    "no axis": (model('<site name="t" zaxis="0 0 0"/>'), "axis without length"),
    "no quaternion": (model('<site name="t" quat="0 0 0 0"/>'), "quaternion without length"),
    "unknown class": (model('<site name="t" class="x"/>'), "has no class 'x' of defaults"),
    "two sites of a name": (model('<site name="s"/>'), "two sites of the name 's'"),
    "a replicate without end": (
        model('<replicate count="1000000000"><site name="r"/></replicate>'),
        "",
    ),
    "not its part": ("<mujocoinclude/>", "a part of a model of MuJoCo"),
    "names that a terminal obeys": (
        model(actuators='<motor name="\u009b31m" joint="\u009b"/>').replace(
            'site="s" gear', 'a="" gear'
        ),
        "motor of no site",
    ),
    "empty": ("<mujoco/>", "no <body>"),
    "another eulerseq": (model(head='<compiler eulerseq="abc"/>'), "eulerseq 'abc'"),
}
"""Models, and a part of the sentence; empty where the robot can be read all the same."""


def cost_and_answer(file: str) -> tuple[int, float, str]:
    """The most memory that a process took to read a file [bytes], its processor time for it [s],
    and the sentence, if any."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.process_time()
    try:
        read_any(file, Exchange())
        sentence = ""
    except FinlabError as error:
        sentence = str(error)
    seconds = time.process_time() - start
    growth = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    return growth * 1024, seconds, sentence


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_model_is_one_sentence(kind: str, tmp_path: Path) -> None:
    folder = tmp_path / "home"
    folder.mkdir()
    secret = tmp_path / "secret.xml"
    secret.write_text(f'<mujocoinclude><body name="{SECRET}"/></mujocoinclude>')
    (folder / "link.xml").symlink_to(secret)
    (folder / "part.xml").write_text("<mujocoinclude/>")
    (folder / "text.xml").write_text("Dear all,")
    (folder / "circle.xml").write_text(
        '<mujocoinclude><include file="circle.xml"/></mujocoinclude>'
    )
    (folder / "deep.xml").write_text(
        f'<mujocoinclude>{"<body>" * 98}<include file="part.xml"/><frame><frame><frame/></frame>'
        f"</frame>{'</body>' * 98}</mujocoinclude>"
    )
    os.mkfifo(folder / "pipe.xml")
    content, said = HOSTILE[kind]
    file = folder / "robot.xml"
    file.write_text(content.replace("{secret}", str(secret)))
    before = {path: path.stat().st_mtime for path in tmp_path.rglob("*")}
    memory, seconds, sentence = in_worker(cost_and_answer, str(file))
    assert seconds < SECONDS and memory < BYTES
    assert SECRET not in sentence and "\n" not in sentence and "fault of finlab" not in sentence
    assert sentence.isprintable()
    if said:
        assert re.search(said, sentence), sentence
    assert {path: path.stat().st_mtime for path in tmp_path.rglob("*")} == before


def test_what_makes_bodies_is_named(tmp_path: Path) -> None:
    file = tmp_path / "robot.xml"
    file.write_text(HOSTILE["a replicate without end"][0])
    exchange = Exchange()
    layout = read_any(str(file), exchange)
    assert layout.names == ("m",)
    assert any("not read, with its mass: <replicate> in hull" in note for note in exchange.notes)


def test_no_file_of_a_model_from_a_browser_is_opened() -> None:
    with pytest.raises(LayoutError, match="did not come along"):
        read_robot(model(head='<include file="part.xml"/>'), "robot.xml", Exchange())
