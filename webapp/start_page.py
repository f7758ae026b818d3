"""The start page: what a newcomer sees first, with three doors and six robots to choose from.

It comes with the page's own file, before any script of the viewer, so it is there while the app
still connects. `start_page.js` decides whether it is shown, and tells what was chosen.
"""

import base64
import json
from collections.abc import Callable
from functools import cache, partial
from importlib.resources import files
from typing import NamedTuple

from markupsafe import Markup

from webapp.markup.words import html
from webapp.page import Page
from webapp.session.files import shipped
from webapp.session.lessons import TOUR
from webapp.session.state import one_of
from webapp.session.targets import FIRST_TARGET
from webapp.viser_internals import run_script

PICTURES = "pictures"
"""Folder of `webapp/markup` with a picture (WebP) of each robot, from `tools/robot_pictures.py`."""


class Example(NamedTuple):
    """A robot of the start page, and what it is asked for at first."""

    title: str
    about: str
    target: tuple[float, float, float, float, float, float] = FIRST_TARGET
    """Wrench [N, N m]."""
    speed: float = 0.0
    """Speed ahead through the water [m/s]."""


ROBOTS = {
    "ucat": Example("U-CAT", "four fins"),
    "turtle_hybrid": Example("Turtle", "four fins, two thrusters", (4.0, 0.0, 20.0, 0.0, 0.0, 0.5)),
    "fish": Example("Fish", "a tail and two fins", (0.4, 0.0, 0.0, 0.0, 0.0, 0.02)),
    "bluerov2_heavy": Example(
        "BlueROV2 Heavy", "eight thrusters", (40.0, 10.0, -20.0, 0.0, 0.0, 4.0)
    ),
    "catamaran": Example(
        "Catamaran", "two pods, a bow thruster", (60.0, 15.0, 0.0, 0.0, 0.0, 12.0)
    ),
    "torpedo": Example(
        "Torpedo", "a propeller, four rudders", (20.0, 0.0, 0.0, 0.0, 2.0, 2.0), 1.5
    ),
}
"""Shipped layouts of the start page by name, in its order."""

SENTENCE = (
    "finlab finds what each fin, thruster and rudder of an underwater robot must do to give the "
    "force that you ask for."
)
"""What all this is."""


class _Door(NamedTuple):
    """One of the three ways in."""

    key: str
    title: str
    about: str
    sign: str
    """Path of its sign, in a box of 24."""


DOORS = (
    _Door("design", "Design mine", "Begin with one actuator, add others", "M12 5v14M5 12h14"),
    _Door("tour", "Show me", f"A tour in {len(TOUR)} stops", "M8 5l11 7-11 7z"),
    _Door("file", "Open a file or log", "A design, or what a robot logged", "M3 19V6h6l2 3h10v10z"),
)


@cache
def start_page() -> bytes:
    """The markup of the start page with its style and script, for the body of the page's file."""
    folder = files("webapp.markup")
    style = Markup(folder.joinpath("start_page.css").read_text("utf-8"))
    script = Markup(files("webapp").joinpath("start_page.js").read_text("utf-8"))
    template = (
        "<style>{}</style><div id='fl-start' role='dialog' aria-modal='true' "
        "aria-labelledby='fl-start-title' hidden><div class='sheet'>"
        "<button class='back' data-start='back' hidden>← Back to your robot</button>"
        "<h1 id='fl-start-title'>{}</h1><div class='doors'>{}</div>"
        "<h2>Or take one of these robots</h2><div class='robots'>{}</div></div></div>"
        "<script>{}</script>"
    )
    doors = [_door(door) for door in DOORS]
    robots = [_robot(name, example) for name, example in ROBOTS.items()]
    return html(template, style, SENTENCE, doors, robots, script).encode()


def _door(door: _Door) -> str:
    """One door; that of files is the label of an input, which asks for one."""
    words = html(
        "<svg viewBox='0 0 24 24' aria-hidden='true'><path d='{}'/></svg>"
        "<span><b>{}</b> <span class='about'>{}</span></span>",
        door.sign,
        door.title,
        door.about,
    )
    if door.key == "file":
        return html("<label><input type='file'>{}</label>", words)
    return html("<button data-start='{}'>{}</button>", door.key, words)


def _robot(name: str, example: Example) -> str:
    """A picture of a robot, which opens it; the size is known before the picture is read."""
    picture = files("webapp.markup").joinpath(PICTURES, f"{name}.webp").read_bytes()
    source = f"data:image/webp;base64,{base64.b64encode(picture).decode()}"
    template = (
        "<button data-start='robot {}'><img src='{}' width='320' height='200' alt=''><b>{}</b> "
        "<span class='about'>{}</span></button>"
    )
    return html(template, name, source, example.title, example.about)


def open_example(page: Page, name: str) -> None:
    """Opens one of `ROBOTS` with what it is asked for first. FinlabError: there is no such one."""
    example = ROBOTS[one_of(name, "robot", ROBOTS)]
    page.session.open_example(shipped()[name], example.target, example.speed)
    page.designs.remind(f"Opened {example.title}")


def connect_start_page(page: Page) -> None:
    """Lets the start page of a browser have its choices heard, and tells it whether there is work
    that it must not lie over."""
    session = page.session
    acts: dict[str, Callable[[], object]] = {
        "design": page.new,
        "tour": partial(session.guide.open, TOUR[0].name),
        "file": lambda: None,
        "back": lambda: None,
    }
    for name in ROBOTS:
        acts[f"robot {name}"] = partial(open_example, page, name)

    def choose(key: str, _text: str) -> None:
        act = acts[one_of(key, "start page", acts)]
        session.has_started = True
        run_script(page.gui, "window.finlabStart?.close();")
        act()

    def linked(name: str, _text: str) -> None:
        """A robot that the address names; work that was found again stays."""
        if not session.has_started:
            session.has_started = True
            open_example(page, name)

    page.presses.on("start", choose)
    page.presses.on("robot-link", linked)
    is_new = not (session.has_started or session.history.past or session.history.future)
    run_script(page.gui, f"window.finlabStart?.ready({json.dumps(is_new)});")


def show_start_page(page: Page) -> None:
    """Lets the browser show it again."""
    run_script(page.gui, "window.finlabStart?.open();")
