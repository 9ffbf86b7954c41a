"""The parameter table: names, types and values of ArduCopter 4.6.

Every parameter travels as a float, whatever its type; ArduPilot casts the value, it does not copy the bits.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import ClassVar

from simulator.parameter_table import TABLE, Kind

__all__ = ["Kind", "Parameter", "Parameters"]

NAME_MAX = 16

_RANGES = {Kind.INT8: (-128, 127), Kind.INT16: (-32768, 32767), Kind.INT32: (-(2**31), 2**31 - 1)}


@dataclass(slots=True)
class Parameter:
    name: str
    kind: Kind
    value: float
    index: int


class Parameters:
    """Values by name, and by index in the order of the list."""

    table: ClassVar[list[tuple[str, Kind, float]]] = TABLE

    def __init__(self, overrides: Iterable[tuple[str, float]] = (), total_count: int = 0) -> None:
        """Adds generated parameters up to `total_count` if the table is shorter."""
        rows: list[tuple[str, Kind, float]] = list(self.table)
        rows += _fillers(total_count - len(rows))
        self._ordered = [Parameter(name, kind, value, i) for i, (name, kind, value) in enumerate(rows)]
        self.version = 0
        """Grows with each change: what is made of the values can be kept until then."""
        self._by_name = {parameter.name: parameter for parameter in self._ordered}
        self._values = {parameter.name: parameter.value for parameter in self._ordered}
        self._follow()
        for name, value in overrides:
            if self.set(name, value) is None:
                raise KeyError(f"no parameter {name!r}, or {value} is no value for it")

    def __len__(self) -> int:
        return len(self._ordered)

    def __iter__(self) -> Iterator[Parameter]:
        return iter(self._ordered)

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def whole(self, name: str) -> int:
        return int(self._values[name])

    def _follow(self) -> None:
        """Works out the values of names that follow from others, after each change."""

    def find(self, name: str) -> Parameter | None:
        return self._by_name.get(name)

    def at(self, index: int) -> Parameter | None:
        return self._ordered[index] if 0 <= index < len(self._ordered) else None

    def on_the_wire(self, parameter: Parameter) -> float:
        return parameter.value

    def hash_on_the_wire(self) -> float | None:
        """None if the autopilot has no such hash."""
        return None

    def from_the_wire(self, name: str, value: float, kind: int) -> Parameter | None:
        """PARAM_SET; ArduPilot ignores the type that the sender states."""
        del kind
        return self.set(name, value)

    def set(self, name: str, value: float) -> Parameter | None:
        """Returns the parameter with its new value, or None if it does not exist or the value is not finite."""
        parameter = self._by_name.get(name)
        if parameter is None or not math.isfinite(value):
            return None
        if parameter.kind is Kind.FLOAT:
            if abs(value) > 3.4e38:
                return None
            parameter.value = struct.unpack("<f", struct.pack("<f", value))[0]
        else:
            low, high = _RANGES[parameter.kind]
            parameter.value = float(min(max(round(value), low), high))
        self._values[name] = parameter.value
        self._follow()
        self.version += 1
        return parameter


def _fillers(count: int) -> list[tuple[str, Kind, float]]:
    """Names and values are deterministic, so that every run lists the same table."""
    kinds = (Kind.FLOAT, Kind.INT8, Kind.INT16, Kind.INT32)
    fillers = []
    for i in range(max(count, 0)):
        kind = kinds[i % 4]
        value = (i % 100) + 0.25 if kind is Kind.FLOAT else float(i % 100)
        fillers.append((f"SIM_X{i:04d}", kind, value))
    return fillers
