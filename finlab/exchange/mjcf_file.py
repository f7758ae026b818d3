"""The text of a MuJoCo model (MJCF) as a tree: includes, defaults, and poses in its conventions.

Nothing but text is read: no assets, and other files only where <include> names one in the folder of
the model or below. `mjcf_read` makes a layout of the tree.
"""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange.description import numbers
from finlab.exchange.exchange import Exchange
from finlab.exchange.xml_models import MAX_DEPTH, MAX_ELEMENTS, root_of
from finlab.files.guarded import is_regular, read_text

MAX_BYTES = 5_000_000
"""Largest text of a model with all that it includes [characters]."""
MAX_INCLUDES = 100
"""Most files that a model includes."""
MAIN_CLASS = "main"
"""The class of defaults that holds where none is named."""
ACTUATOR = "actuator"
"""The tag under which defaults of all kinds of actuators are kept: MuJoCo has one of all."""
ACTUATOR_TAGS = (
    *("motor", "general", "position", "velocity", "intvelocity", "damper", "cylinder", "muscle"),
    *("adhesion", "plugin", "dcmotor"),
)
"""Tags of actuators."""
MOTOR = {"dyntype": "none", "gaintype": "fixed", "gainprm": "1", "biastype": "none"}
"""What <motor> stands for, as attributes of <general>."""
ORIENTATIONS = ("euler", "axisangle", "xyaxes", "zaxis", "quat")
"""Attributes of an orientation, of which an element has one."""
PARTIAL = ("gear", "gainprm", "biasprm", "dynprm", "size")
"""Lists of which an element may give the first numbers alone; the others stay those of its
class."""
Attributes = dict[str, str]
"""Attributes of an element by name, with those of its class."""


class MjcfFile:
    """A model of MuJoCo with what it includes, and its conventions."""

    def __init__(self, root: Element, exchange: Exchange) -> None:
        """Reads the files that the model includes.

        Args:
            root: its outermost element, <mujoco>.
            exchange: the path of the file.

        Raises:
            LayoutError: it includes a file elsewhere, or one twice, is too large, or names no known
                convention.
        """
        if root.tag != "mujoco":
            raise LayoutError(
                f"is a part of a model of MuJoCo, <{root.tag:.40}>; give its <mujoco>"
            )
        self.root = root
        self._path = exchange.path
        self._included: set[Path] = set()
        self._n_characters = 0
        self._include()
        settings: Attributes = {}
        for compiler in root.findall("compiler"):
            settings |= compiler.attrib
        self.compiler = settings
        """Attributes of <compiler>."""
        if settings.get("coordinate", "local") != "local":
            raise LayoutError("has global coordinates, which MuJoCo no longer reads; save it again")
        self.angle = 1.0 if settings.get("angle") == "radian" else math.pi / 180.0
        """What an angle of 1 stands for [rad]."""
        self._sequence = settings.get("eulerseq", "xyz")
        if len(self._sequence) != 3 or not set(self._sequence.lower()) <= set("xyz"):
            raise LayoutError(f"has eulerseq {self._sequence!r:.20}, expected such as xyz")
        self._classes: dict[str, dict[str, Attributes]] = {MAIN_CLASS: {}}
        for default in root.findall("default"):
            self._read_class(default)
            # Before MuJoCo 3 the outermost class could have another name.
            name = default.get("class", MAIN_CLASS)
            self._classes[name] = self._classes[MAIN_CLASS]

    def attributes(self, element: Element, child_class: str = "") -> Attributes:
        """Returns the attributes of an element, with those of its class of defaults.

        Args:
            element: a site, joint, geom or actuator.
            child_class: the class that holds where the element names none.

        Raises:
            LayoutError: there is no such class.
        """
        name = element.get("class") or child_class or MAIN_CLASS
        if name not in self._classes:
            raise LayoutError(
                f"has no class {name!r:.60} of defaults, which a <{element.tag}> names"
            )
        return _merged(self._classes[name].get(_kept_as(element.tag), {}), element)

    def pose(self, attributes: Mapping[str, str], what: str) -> Array:
        """Returns the pose (4, 4) of a body, frame, site, joint or geom [m].

        Args:
            attributes: its attributes.
            what: what it is, for an error.

        Raises:
            LayoutError: a value is no number, or an axis has no length.
        """
        pose = np.eye(4)
        if "fromto" in attributes:
            ends = numbers(attributes["fromto"], 6, f"fromto of {what}").reshape(2, 3)
            pose[:3, 3] = ends.mean(axis=0)
            pose[:3, :3] = _z_along(ends[0] - ends[1], what)
            return pose
        pose[:3, 3] = numbers(attributes.get("pos", "0 0 0"), 3, f"pos of {what}")
        pose[:3, :3] = self._rotation(attributes, what)
        return pose

    def _rotation(self, attributes: Mapping[str, str], what: str) -> Array:
        """The rotation (3, 3) of a pose by whichever attribute has it."""
        if "euler" in attributes:
            angles = numbers(attributes["euler"], 3, f"euler of {what}") * self.angle
            rotation = np.eye(3)
            for letter, angle in zip(self._sequence, angles, strict=True):
                turn = Rotation.from_euler(letter.lower(), angle).as_matrix()
                # A small letter is an axis that turns along, a capital one an axis that stays.
                rotation = rotation @ turn if letter.islower() else turn @ rotation
            return rotation
        if "axisangle" in attributes:
            values = numbers(attributes["axisangle"], 4, f"axisangle of {what}")
            axis = _unit(values[:3], what)
            return np.asarray(Rotation.from_rotvec(axis * values[3] * self.angle).as_matrix())
        if "xyaxes" in attributes:
            values = numbers(attributes["xyaxes"], 6, f"xyaxes of {what}")
            x = _unit(values[:3], what)
            y = _unit(values[3:] - (values[3:] @ x) * x, what)
            return np.column_stack([x, y, np.cross(x, y)])
        if "zaxis" in attributes:
            return _z_along(numbers(attributes["zaxis"], 3, f"zaxis of {what}"), what)
        if "quat" in attributes:
            w, x, y, z = numbers(attributes["quat"], 4, f"quat of {what}")
            quaternion = np.array([x, y, z, w])
            if not quaternion.any():
                raise LayoutError(f"{what} has a quaternion without length")
            return np.asarray(Rotation.from_quat(quaternion).as_matrix())
        return np.eye(3)

    def _include(self) -> None:
        """Puts the elements of included files in the place of <include>."""
        stack = [(self.root, 1, self._folder)]
        count = 0
        while stack:
            element, depth, folder = stack.pop()
            count += 1
            if depth > MAX_DEPTH or count > MAX_ELEMENTS:
                raise LayoutError(
                    f"holds over {MAX_ELEMENTS:,} elements of XML, or is deeper than {MAX_DEPTH}"
                )
            for child, home in [*self._children(element, folder)]:
                stack.append((child, depth + 1, home))

    @property
    def _folder(self) -> Path:
        """The folder of the model; files of a model from a browser are never looked for."""
        return Path() if self._path is None else self._path.parent

    def _children(self, element: Element, folder: Path) -> Iterator[tuple[Element, Path]]:
        """The children of an element with the folders of their files, once those that are included
        are among them."""
        children: list[tuple[Element, Path]] = []
        pending = [(child, folder) for child in reversed(element)]
        while pending:
            child, home = pending.pop()
            if child.tag != "include":
                children.append((child, home))
                continue
            path = self._included_path(child.get("file", ""), home)
            pending += [(part, path.parent) for part in reversed(self._root_of(path))]
        element[:] = [child for child, _ in children]
        yield from children

    def _included_path(self, file: str, home: Path) -> Path:
        """The path that an <include> names: from the model's folder, or from that of its own
        file."""
        shown = f"{file!r:.80}"
        if self._path is None:
            raise LayoutError(
                f"includes {shown}, which did not come along; paste it in, or take `finlab layout "
                "convert`, which opens it"
            )
        folder = self._path.parent
        for start in (folder, home):
            try:
                path = (start / file).resolve()
            except (OSError, RuntimeError, ValueError):  # a circle of links, a NUL byte
                continue
            if not path.is_relative_to(folder) or Path(file).is_absolute():
                raise LayoutError(
                    f"includes {shown}, a file elsewhere; expected one in the model's folder or "
                    "below, by its path from there: copy it there"
                )
            if is_regular(path):
                return path
        raise LayoutError(f"includes {shown}, and there is no such file")

    def _root_of(self, path: Path) -> Element:
        """The outermost element of an included file."""
        if path in self._included or path == self._path:
            raise LayoutError(f"includes {path.name!r:.60} twice, or from itself")
        self._included.add(path)
        if len(self._included) > MAX_INCLUDES:
            raise LayoutError(f"includes more than {MAX_INCLUDES} files; put them into one")
        text = read_text(path, MAX_BYTES, "a model of MuJoCo", LayoutError)
        self._n_characters += len(text)
        if self._n_characters > MAX_BYTES:
            raise LayoutError(f"includes over {MAX_BYTES:,} characters; make it smaller")
        return root_of(text)

    def _read_class(self, main: Element) -> None:
        """Reads a class of defaults and those inside it, which begin as it is."""
        stack = [(main, MAIN_CLASS, MAIN_CLASS)]
        while stack:
            element, name, parent = stack.pop()
            settings = {tag: {**values} for tag, values in self._classes[parent].items()}
            inner = []
            for child in element:
                if child.tag == "default":
                    inner.append(child)
                    continue
                tag = _kept_as(child.tag)
                settings[tag] = _merged(settings.get(tag, {}), child)
            self._classes[name] = settings
            for child in inner:
                stack.append((child, child.get("class", ""), name))


def _kept_as(tag: str) -> str:
    """The tag under which the defaults of an element are kept."""
    return ACTUATOR if tag in ACTUATOR_TAGS else tag


def _merged(inherited: Mapping[str, str], element: Element) -> Attributes:
    """The attributes of an element, in which what it does not say is inherited."""
    own = dict(element.attrib)
    values = {**inherited}
    if element.tag == "motor":
        values |= MOTOR
    elif element.tag in ACTUATOR_TAGS and element.tag != "general":
        values["biastype"] = element.tag  # more than a gain: no thruster
    if any(key in own for key in ORIENTATIONS):
        for key in ORIENTATIONS:
            values.pop(key, None)
    for key in PARTIAL:
        if key in own:
            words = own[key].split()
            own[key] = " ".join([*words, *values.get(key, "").split()[len(words) :]])
    return values | own


def _unit(values: Array, what: str) -> Array:
    """A vector (3,) of length 1."""
    length = float(np.linalg.norm(values))
    if length < 1e-9:
        raise LayoutError(f"{what} has an axis without length")
    return values / length


def _z_along(direction: Array, what: str) -> Array:
    """The least rotation (3, 3) that takes z into a direction (3,)."""
    z = _unit(direction, what)
    axis = np.array([-z[1], z[0], 0.0])  # e_z x z
    sine = float(np.linalg.norm(axis))
    if sine < 1e-15:
        axis = np.array([1.0, 0.0, 0.0])
        sine = 0.0
    else:
        axis = axis / sine
    angle = math.atan2(sine, z[2])
    return np.asarray(Rotation.from_rotvec(axis * angle).as_matrix())
