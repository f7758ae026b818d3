"""Forces in fractions whose wrench is exactly the one that is asked: those of a search by floats,
corrected along as many axes of actuators as the wrench has."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from finlab.analysis import check_proof
from finlab.analysis.proof_premises import Part, ProofActuator
from finlab.arrays import Array

DIGITS = 9
"""Digits of a force in a file, beyond those of its largest force; the last ones of each corner are
fractions."""
RANK_TOLERANCE = 1e-9
"""Share of the strongest wrench below which a direction has no authority [1]."""


class FrameAxis(NamedTuple):
    """A direction in which the force of an actuator may change."""

    direction: list[Fraction]
    """Along the actuator's axes (2,)."""
    column: list[Fraction]
    """Its wrench, of the axes that count."""


class Basis(NamedTuple):
    """Axes of actuators whose forces make up for what is missing of a wrench."""

    frames: list[list[FrameAxis]]
    """Those of each actuator."""
    axes: list[tuple[int, int]]
    """Index of the actuator, and of its axis."""
    rows: list[int]
    """Axes of the wrench that they give, by their indices among those that count."""
    inverse: list[list[Fraction]]
    """Forces per missing wrench."""


class ExactForces:
    """Corrects forces of the actuators of a proof."""

    def __init__(
        self,
        actuators: Sequence[ProofActuator],
        columns: Sequence[Sequence[list[Fraction]]],
        scale: Array,
    ) -> None:
        """Takes the actuators.

        Args:
            actuators: n of them.
            columns: of each the wrench of 1 N along each of its axes, of the axes that count (r).
            scale: divisors (r,) that make these comparable [1, m].
        """
        self._actuators = actuators
        self._columns = columns
        self._scale = scale

    def basis(self, lost: Sequence[str], parts: Sequence[Part]) -> Basis:
        """Returns as many axes of working actuators as there are independent axes of the wrench, in
        the axes of some parts."""
        frames = []
        labels = []
        columns = []
        for i, (actuator, part) in enumerate(zip(self._actuators, parts, strict=True)):
            frame = self._frame(i, part)
            frames.append(frame)
            if actuator.name in lost:
                continue
            for k, axis in enumerate(frame):
                labels.append((i, k))
                columns.append(np.array(axis.column, np.float64) * actuator.radius)
        scaled = np.array(columns).T / self._scale[:, None]
        column_order, rank = _pivots(scaled)
        chosen = column_order[:rank]
        row_order, _ = _pivots(scaled[:, chosen].T)
        rows = sorted(row_order[:rank])
        matrix = []
        for row in rows:
            line = []
            for column in chosen:
                i, k = labels[column]
                line.append(frames[i][k].column[row])
            matrix.append(line)
        return Basis(frames, [labels[column] for column in chosen], rows, _inverse(matrix))

    def _frame(self, index: int, part: Part) -> list[FrameAxis]:
        """The directions in which forces of a part may change: the actuator's axes, or a line."""
        own = self._columns[index]
        zero = Fraction(0)
        if part.line is None:
            directions = [[Fraction(1), zero], [zero, Fraction(1)]][: len(own)]
        else:
            directions = [[fraction_of(value) for value in part.line]]
        frame = []
        for direction in directions:
            column = []
            for row in range(len(self._scale)):
                column.append(check_proof.dot(direction[: len(own)], [each[row] for each in own]))
            frame.append(FrameAxis(direction, column))
        return frame

    def forces(
        self, lost: Sequence[str], basis: Basis, wrench: list[Fraction], forces: Array
    ) -> dict[str, list[str]]:
        """Returns forces (n, 2) as fractions that give a wrench exactly, by name."""
        exact = []
        missing = [*wrench]
        for i, (actuator, frame) in enumerate(zip(self._actuators, basis.frames, strict=True)):
            own = []
            for axis in frame:
                direction = np.array(axis.direction, np.float64)
                along = float(direction @ forces[i]) / float(direction @ direction)
                size = rounded(along, actuator.radius)
                own.append(size)
                if actuator.name not in lost and size:
                    missing = [w - size * c for w, c in zip(missing, axis.column, strict=True)]
            exact.append(own)
        left = [missing[row] for row in basis.rows]
        for (i, k), line in zip(basis.axes, basis.inverse, strict=True):
            exact[i][k] += check_proof.dot(line, left)
        result = {}
        for actuator, frame, own in zip(self._actuators, basis.frames, exact, strict=True):
            if actuator.name in lost:
                continue
            force = []
            for k in range(actuator.n_axes):
                force.append(text_of(check_proof.dot(own, [axis.direction[k] for axis in frame])))
            result[actuator.name] = force
        return result


def _pivots(matrix: Array) -> tuple[list[int], int]:
    """The order of columns in which each is as far as possible from the span of those before it,
    and the numerical rank (QR with column pivoting; Golub and Van Loan, 5.4)."""
    left = matrix.copy()
    order: list[int] = []
    largest = float(np.linalg.norm(matrix, axis=0).max(initial=0.0))
    for _ in range(min(matrix.shape)):
        norms = np.linalg.norm(left, axis=0)
        norms[order] = 0.0
        best = int(norms.argmax())
        if norms[best] <= RANK_TOLERANCE * largest:
            break
        order.append(best)
        direction = left[:, best] / norms[best]
        left = left - np.outer(direction, direction @ left)
    return order, len(order)


def _inverse(matrix: list[list[Fraction]]) -> list[list[Fraction]]:
    """The inverse of a square matrix in fractions, by Gauss and Jordan's elimination."""
    n = len(matrix)
    rows = []
    for i, line in enumerate(matrix):
        rows.append([*line, *(Fraction(int(i == j)) for j in range(n))])
    for i in range(n):
        pivot = max(range(i, n), key=lambda row: abs(rows[row][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        head = rows[i][i]
        rows[i] = [value / head for value in rows[i]]
        for j in range(n):
            factor = rows[j][i]
            if j != i and factor:
                rows[j] = [a - factor * b for a, b in zip(rows[j], rows[i], strict=True)]
    return [row[n:] for row in rows]


def fraction_of(value: float) -> Fraction:
    """Returns a number as it is written in a file."""
    return Fraction(repr(value))


def rounded(size: float, largest: float) -> Fraction:
    """Returns a force with `DIGITS` digits below those of the largest force."""
    places = DIGITS - math.floor(math.log10(largest)) if largest > 0.0 else DIGITS
    unit = Fraction(10) ** places
    return Fraction(round(Fraction(size) * unit)) / unit


def text_of(value: Fraction) -> str:
    """Returns a fraction for a file, as a decimal where it is a short one."""
    for places in range(2 * DIGITS):
        scaled = value * 10**places
        if scaled.denominator == 1:
            digits = str(abs(scaled.numerator)).rjust(places + 1, "0")
            sign = "-" if value < 0 else ""
            return sign + (f"{digits[:-places]}.{digits[-places:]}" if places else digits)
    return str(value)
