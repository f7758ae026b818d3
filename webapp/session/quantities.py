"""Numbers as people type them: `12 cm`, `45 deg`, `1/3`, `-.03`, `1e-2`, `2 * (3 mm + 1 cm)`, `30,5`.

Nothing is ever evaluated as code: a few lines read sums and products from left to right.
"""

import math
import re
from functools import cache
from typing import NamedTuple

from finlab.errors import FinlabError

MAX_TEXT = 100
"""Longest text that is read."""
MAX_POWER = 9
"""Largest exponent."""

Powers = tuple[int, int, int, int, int]


class Quantity(NamedTuple):
    """A value in SI units, and of which."""

    value: float
    """In metres, kilograms, seconds, radians and shares of one."""
    powers: Powers = (0, 0, 0, 0, 0)
    """Powers of these five."""


def _unit(factor: float, *powers: int) -> Quantity:
    m, kg, s, rad, share = (*powers, 0, 0, 0, 0, 0)[:5]
    return Quantity(factor, (m, kg, s, rad, share))


UNITS = {
    **{name: _unit(f, 1) for name, f in {"m": 1, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "in": 0.0254}.items()},
    **{name: _unit(f, 0, 1) for name, f in {"kg": 1, "g": 1e-3, "t": 1e3}.items()},
    **{name: _unit(f, 0, 0, 1) for name, f in {"s": 1, "ms": 1e-3, "min": 60, "h": 3600}.items()},
    **{
        name: _unit(f, 0, 0, 0, 1) for name, f in {"rad": 1, "deg": math.pi / 180, "°": math.pi / 180}.items()
    },
    **{name: _unit(f, 1, 1, -2) for name, f in {"N": 1, "mN": 1e-3, "kN": 1e3}.items()},
    **{
        name: _unit(f, 2, 1, -2) for name, f in {"Nm": 1, "J": 1, "kJ": 1e3, "Wh": 3600, "kWh": 3.6e6}.items()
    },
    **{name: _unit(f, 2, 1, -3) for name, f in {"W": 1, "mW": 1e-3, "kW": 1e3}.items()},
    "Hz": _unit(1, 0, 0, -1),
    "%": _unit(0.01, 0, 0, 0, 0, 1),
    "pi": Quantity(math.pi),
    "π": Quantity(math.pi),
}
"""Units, and one number, by name."""
EXAMPLES = {
    "m": "12 cm",
    "°": "45 or 0.5 rad",
    "N": "1.5 or 300 mN",
    "N m": "0.2 or 3 N cm",
    "cm/s": "5 or 0.05 m/s",
    "cm": "5 or 0.05 m",
    "kg": "2.5 or 900 g",
}
"""What may be typed where a unit is expected."""

_NUMBER = r"\d+\.?\d*(?:e[+-]?\d+)?|\.\d+(?:e[+-]?\d+)?"
_TOKEN = re.compile(rf"\s*(?:({_NUMBER})|([a-zπ]+|[°%])|(\*\*|[-+*/^()]))", re.ASCII | re.IGNORECASE)
_SIGNS = str.maketrans(
    {"−": "-", "–": "-", "×": "*", "·": "*", "⋅": "*", "÷": "/", ",": "."} | {"º": "°", "²": "^2", "³": "^3"}
)


def read_number(text: str, unit: str = "") -> float:
    """The number that a text stands for, in a unit; a number without one counts as given in it.

    Args:
        text: what was typed; a comma is a decimal point.
        unit: such as `m`, `°`, `N m`; empty for a mere number.

    Raises:
        FinlabError: it stands for none, or is of another unit; the sentence tells what may be typed.
    """
    wanted = _unit_of(unit)
    try:
        found = _Reader(text).quantity() if len(text) <= MAX_TEXT else None
    except (ZeroDivisionError, OverflowError):
        found = Quantity(math.inf)
    if found is None:
        raise FinlabError(f"{text.strip()!r:.40} is not a number; {_expected(unit)}")
    if not math.isfinite(found.value):
        raise FinlabError(f"{text.strip()!r:.40} is not a finite number; {_expected(unit)}")
    if found.powers == (0, 0, 0, 0, 0):
        return found.value
    if found.powers != wanted.powers:
        of = f"in {unit}" if unit else "without a unit"
        raise FinlabError(f"{text.strip()!r:.40} is not {of}; {_expected(unit)}")
    return found.value / wanted.value


def _expected(unit: str) -> str:
    return f"type for example {EXAMPLES.get(unit, f'1.5 {unit}'.strip() + ' or 1/3')}"


@cache
def _unit_of(unit: str) -> Quantity:
    found = _Reader(f"1 {unit}").quantity()
    assert found is not None, f"{unit} is no unit"
    return found


class _Reader:
    """Reads one text, once; every step gives None where the text makes no sense."""

    def __init__(self, text: str) -> None:
        self._tokens: list[tuple[str, str, str]] = []
        self._place = 0
        plain, at = text.translate(_SIGNS).rstrip(), 0
        while at < len(plain):
            found = _TOKEN.match(plain, at)
            if found is None:
                self._tokens = []
                break
            self._tokens.append(found.groups(default=""))  # type: ignore[arg-type]
            at = found.end()

    def quantity(self) -> Quantity | None:
        """The whole text; None where anything is left over."""
        found = self._sum()
        return found if self._place == len(self._tokens) else None

    def _next(self, signs: str = "") -> str:
        """The next sign, taken, if it is one of some; else nothing."""
        if self._place < len(self._tokens):
            sign = self._tokens[self._place][2]
            if sign and sign in signs.split():
                self._place += 1
                return sign
        return ""

    def _sum(self) -> Quantity | None:
        total = self._product()
        while total is not None and (sign := self._next("+ -")):
            part = self._product()
            if part is None or part.powers != total.powers:
                return None
            total = Quantity(total.value + (part.value if sign == "+" else -part.value), total.powers)
        return total

    def _product(self) -> Quantity | None:
        product = self._signed()
        while product is not None:
            sign = self._next("* /")
            if not sign and not self._names_follow():
                break
            part = self._signed() if sign else self._power()
            product = None if part is None else _times(product, part, -1 if sign == "/" else 1)
        return product

    def _names_follow(self) -> bool:
        """Whether a unit stands right behind: it multiplies what stands before it."""
        return self._place < len(self._tokens) and bool(self._tokens[self._place][1])

    def _signed(self) -> Quantity | None:
        sign = 1.0
        while found := self._next("+ -"):
            sign = -sign if found == "-" else sign
        part = self._power()
        return None if part is None else Quantity(sign * part.value, part.powers)

    def _power(self) -> Quantity | None:
        base = self._atom()
        if base is None or not self._next("^ **"):
            return base
        exponent = self._signed()
        if exponent is None or any(exponent.powers) or exponent.value not in range(-MAX_POWER, MAX_POWER + 1):
            return None
        n = round(exponent.value)
        m, kg, s, rad, share = (n * power for power in base.powers)
        return Quantity(base.value**n, (m, kg, s, rad, share))

    def _atom(self) -> Quantity | None:
        if self._next("("):
            inside = self._sum()
            return inside if self._next(")") else None
        if self._place == len(self._tokens):
            return None
        number, name, _ = self._tokens[self._place]
        self._place += 1
        return Quantity(float(number)) if number else UNITS.get(name)


def _times(a: Quantity, b: Quantity, sign: int) -> Quantity:
    m, kg, s, rad, share = (p + sign * q for p, q in zip(a.powers, b.powers, strict=True))
    return Quantity(a.value * b.value if sign > 0 else a.value / b.value, (m, kg, s, rad, share))
