"""Colours and sizes of everything that is drawn: the Okabe-Ito palette, safe for colour-blind
eyes."""

from dataclasses import dataclass
from functools import cache

Rgb = tuple[int, int, int]

BLUE: Rgb = (0, 114, 178)
GREEN: Rgb = (0, 158, 115)
VERMILLION: Rgb = (213, 94, 0)
ORANGE: Rgb = (230, 159, 0)
SKY: Rgb = (86, 180, 233)
YELLOW: Rgb = (240, 228, 66)

BRAND: Rgb = (0, 92, 144)
ASKED = BLUE
"""The target wrench, wherever it is drawn."""
DELIVERED = GREEN
"""The wrench that the fins give."""
MISSING = VERMILLION
"""What is left undone, and every warning."""
WATER = SKY
TAKEN = ORANGE
"""What jets take from the force of an actuator."""
REACH: Rgb = (176, 142, 84)
"""What could be asked for: attainable sets, and the marks on the sliders of the target."""
REACH_DARK: Rgb = (214, 180, 120)
NEARLY: Rgb = (150, 112, 0)
"""What could be had but is only nearly given."""
UNLEARNED: Rgb = (112, 92, 168)
"""What a method has not learned."""
DEAD: Rgb = (150, 154, 158)

FIN_COLORS: tuple[Rgb, ...] = (
    YELLOW,
    (148, 118, 224),  # violet
    (236, 138, 184),  # pink
    (134, 128, 34),  # olive
    (200, 178, 246),  # lavender
    (160, 52, 104),  # wine
    (186, 206, 70),  # lime
    (122, 62, 140),  # plum
    (52, 46, 16),
    (46, 22, 112),
    (106, 16, 250),
    (226, 58, 172),
    (82, 88, 16),
    (106, 16, 70),
    (172, 16, 202),
    (220, 214, 184),
    (172, 166, 118),
    (76, 22, 178),
    (142, 112, 124),
    (214, 130, 250),
    (136, 166, 16),
    (250, 208, 250),
    (148, 70, 250),
    (76, 52, 106),
    (190, 130, 148),
    (238, 178, 190),
    (112, 106, 70),
    (106, 16, 142),
    (232, 34, 112),
    (106, 58, 70),
    (226, 76, 250),
    (208, 190, 124),
)
"""One colour per fin, in order. None is near blue, green or vermillion: those hues are reserved for
what is asked, delivered and missing. From the ninth on each is the one farthest from those before
it in Oklab (B. Ottosson, 2020), for common and for dichromatic sight (Viénot, Brettel and Mollon,
1999): so hues come back lighter and darker."""

MODE_COLORS: tuple[Rgb, ...] = (
    (
        92,
        92,
        196,
    ),  # indigo, teal, wine, olive, ...: after Paul Tol's "muted" set, told apart by every eye,
    (52, 152, 134),  # with the dark ones lightened, so that they can be seen on both themes
    (184, 66, 122),
    (148, 144, 44),
    (38, 136, 72),
    (204, 102, 119),
    (74, 152, 206),
    (158, 92, 178),
)


@dataclass(frozen=True)
class Look:
    """What differs between the light and the dark theme: the water at the top and bottom of the
    view, fine and strong lines of the floor, the hull, the window that marks the bow, shafts and
    struts, thin lines, outlines of arrows."""

    water_top: Rgb
    water_bottom: Rgb
    grid: Rgb
    grid_section: Rgb
    hull: Rgb
    glass: Rgb
    metal: Rgb
    line: Rgb
    halo: Rgb


LIGHT = Look(
    water_top=(241, 247, 250),
    water_bottom=(190, 218, 232),
    grid=(176, 203, 216),
    grid_section=(142, 176, 193),
    hull=(226, 230, 233),
    glass=(44, 62, 78),
    metal=(98, 108, 118),
    line=(84, 104, 118),
    halo=(22, 32, 40),
)
DARK = Look(
    water_top=(24, 42, 54),
    water_bottom=(9, 18, 26),
    grid=(30, 54, 68),
    grid_section=(48, 80, 98),
    hull=(176, 184, 190),
    glass=(58, 80, 100),
    metal=(120, 130, 140),
    line=(150, 170, 184),
    halo=(248, 250, 252),
)


def look(dark: bool) -> Look:
    """The look of the dark or the light theme."""
    return DARK if dark else LIGHT


@cache
def ink(color: Rgb) -> str:
    """Colour of a number on a colour, as CSS: dark or light, whichever stands out."""
    red, green, blue = color
    return "#111" if 0.299 * red + 0.587 * green + 0.114 * blue > 118 else "#fff"


@cache
def fin_color(index: int) -> Rgb:
    """Colour of the fin at this place in the layout."""
    return FIN_COLORS[index % len(FIN_COLORS)]


@cache
def css(color: Rgb, alpha: float = 1.0) -> str:
    """The colour as CSS."""
    return f"rgba({color[0]},{color[1]},{color[2]},{alpha:g})"
