"""Transforms, as Mitsuba's ``ScalarTransform4f`` chains them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Union

_Triple = Union[Sequence[float], Any]


def _numbers(values: _Triple, count: int, what: str) -> tuple[float, ...]:
    numbers = tuple(float(value) for value in values)
    if len(numbers) != count:
        raise ValueError(f"{what} has {count} numbers, not {len(numbers)}")
    return numbers


def _text(numbers: Sequence[float]) -> str:
    return ", ".join(repr(number) for number in numbers)


class Transform:
    """An affine transform: a chain of steps, of which the last one acts first.

    >>> from pointillist import Transform
    >>> steps = Transform().translate([0, 1, 0]).rotate([0, 1, 0], 90).scale(2)
    >>> print(*steps.elements(), sep="\\n")
    <scale value="2.0, 2.0, 2.0"/>
    <rotate value="0.0, 1.0, 0.0" angle="90.0"/>
    <translate value="0.0, 1.0, 0.0"/>
    """

    def __init__(self, matrix: Any = None) -> None:
        """The identity, or a 4×4 matrix of rows."""
        self._steps: tuple[str, ...] = ()
        if matrix is not None:
            self._steps = self._matrix(matrix)._steps

    def _then(self, step: str) -> Transform:
        chained = Transform()
        chained._steps = (*self._steps, step)
        return chained

    def _matrix(self, matrix: Any) -> Transform:
        rows = [_numbers(row, 4, "a row of a matrix") for row in matrix]
        if len(rows) != 4:
            raise ValueError(f"a matrix has 4 rows, not {len(rows)}")
        return self._then(f'<matrix value="{" ".join(repr(v) for row in rows for v in row)}"/>')

    def __matmul__(self, other: Transform) -> Transform:
        """First ``other``, then this transform."""
        both = Transform()
        both._steps = self._steps + other._steps
        return both

    def translate(self, by: _Triple) -> Transform:
        """Moves by a vector."""
        return self._then(f'<translate value="{_text(_numbers(by, 3, "a vector"))}"/>')

    def scale(self, by: Union[float, _Triple]) -> Transform:
        """Scales by one number, or one for each axis."""
        factors = (float(by),) * 3 if isinstance(by, (int, float)) else _numbers(by, 3, "a scale")
        return self._then(f'<scale value="{_text(factors)}"/>')

    def rotate(self, axis: _Triple, angle: float) -> Transform:
        """Turns about an axis through the origin by an angle in degrees."""
        direction = _text(_numbers(axis, 3, "an axis"))
        return self._then(f'<rotate value="{direction}" angle="{float(angle)!r}"/>')

    def look_at(self, origin: _Triple, target: _Triple, up: _Triple = (0.0, 1.0, 0.0)) -> Transform:
        """Stands at ``origin`` and looks at ``target``, with ``up`` upwards in the picture."""
        places = {"origin": origin, "target": target, "up": up}
        words = (f'{name}="{_text(_numbers(place, 3, name))}"' for name, place in places.items())
        return self._then(f"<lookat {' '.join(words)}/>")

    def matrix(self, rows: Any) -> Transform:
        """Multiplies by a 4×4 matrix of rows."""
        return self._matrix(rows)

    def elements(self) -> list[str]:
        """The steps as elements of a scene file, in the order in which they act."""
        return list(reversed(self._steps))
