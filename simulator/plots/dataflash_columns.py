"""A log in ArduPilot's format as the columns of a picture: the vehicles' of `tower-sim`, of ArduPilot's own simulator,
of a real Copter.

ATT and POS are what the vehicle believed. SIM is the truth, which only ArduPilot's simulator writes; RCOU are the
outputs. What a log does not have is left out.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from simulator.dataflash import FMT, HEAD
from simulator.flight_log import NotALog
from simulator.physics.rotation import Floats

MAX_BYTES = 256 * 1024 * 1024
M_PER_DEG = 111_319.5
_CODES = {
    "a": "64s", "b": "b", "B": "B", "h": "h", "H": "H", "i": "i", "I": "I", "f": "f", "d": "d", "n": "4s", "N": "16s",
    "Z": "64s", "c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "M": "B", "q": "q", "Q": "Q", "g": "e",
}  # fmt: skip
_SCALES = {"c": 0.01, "C": 0.01, "e": 0.01, "E": 0.01, "L": 1e-7}
_WANTED = frozenset({"ATT", "POS", "SIM", "RCOU", "BAT"})


@dataclass(frozen=True, slots=True)
class _Format:
    name: str
    length: int
    """With the three bytes before the fields."""
    letters: str
    labels: tuple[str, ...]

    def read(self, data: bytes, at: int) -> dict[str, float]:
        packing = "<" + "".join(_CODES[letter] for letter in self.letters)
        values = struct.unpack_from(packing, data, at + 3)
        named = zip(self.labels, values, self.letters, strict=False)
        return {label: v * _SCALES.get(letter, 1) for label, v, letter in named if not isinstance(v, bytes)}


def columns_of(data: bytes) -> Mapping[str, Sequence[float]]:
    """Returns columns as `flight_log.read` names them, of those that the log has. Raises NotALog."""
    if len(data) > MAX_BYTES:
        raise NotALog("this log is too long")
    kinds: dict[str, list[dict[str, float]]] = {}
    for name, record in _records(data):
        kinds.setdefault(name, []).append(record)
    try:
        return _columns({name: _table(records) for name, records in kinds.items()})
    except KeyError as error:
        raise NotALog(f"this log has no {error.args[0]}") from error


def _records(data: bytes) -> Iterator[tuple[str, dict[str, float]]]:
    """Skips what is damaged."""
    formats: dict[int, _Format] = {}
    head_at, fmt_length = data.find(HEAD), 3 + struct.calcsize(FMT.packing)
    while 0 <= head_at < len(data) - 3:
        kind = data[head_at + 2]
        if kind == FMT.number and head_at + fmt_length <= len(data):
            number, length, name, letters, labels = struct.unpack_from(FMT.packing, data, head_at + 3)
            made = _Format(_text(name), length, _text(letters), tuple(_text(labels).split(",")))
            known = all(letter in _CODES for letter in made.letters)
            if known and length == 3 + struct.calcsize("<" + "".join(_CODES[x] for x in made.letters)):
                formats[number] = made
            step = fmt_length
        elif kind in formats and head_at + formats[kind].length <= len(data):
            found = formats[kind]
            if found.name in _WANTED:
                yield found.name, found.read(data, head_at)
            step = found.length
        else:
            step = 2
        head_at = data.find(HEAD, head_at + step)


def _text(field: bytes) -> str:
    return field.split(b"\0", 1)[0].decode("ascii", "replace")


def _table(records: list[dict[str, float]]) -> dict[str, Floats]:
    labels = records[0].keys()
    alike = [record for record in records if record.keys() == labels]
    return {label: np.array([record[label] for record in alike], dtype=np.float64) for label in labels}


def _columns(tables: Mapping[str, dict[str, Floats]]) -> Mapping[str, Sequence[float]]:
    """Raises KeyError."""
    attitude = tables["ATT"]
    times_us = attitude["TimeUS"]
    columns: dict[str, Floats] = {"time_s": (times_us - times_us[0]) * 1e-6}

    def then(table: Mapping[str, Floats], label: str, *, turns: bool = False) -> Floats:
        values = np.unwrap(table[label], period=360.0) if turns else table[label]
        return np.asarray(np.interp(times_us, table["TimeUS"], values))

    for name, label in (("roll", "Roll"), ("pitch", "Pitch"), ("yaw", "Yaw")):
        columns[f"estimate_{name}_deg"] = attitude[label]
    place, truth = tables.get("POS"), tables.get("SIM")
    if place is not None:
        origin = (float(place["Lat"][0]), float(place["Lng"][0]))
        north, east = _metres(origin, then(place, "Lat"), then(place, "Lng"))
        columns |= {"estimate_north_m": north, "estimate_east_m": east, "estimate_alt_m": then(place, "RelHomeAlt")}
        if truth is not None:
            home_m = float(place["Alt"][0] - place["RelHomeAlt"][0])
            north, east = _metres(origin, then(truth, "Lat"), then(truth, "Lng"))
            columns |= {"north_m": north, "east_m": east, "alt_m": then(truth, "Alt") - home_m}
    if truth is not None:
        for name, label in (("roll", "Roll"), ("pitch", "Pitch"), ("yaw", "Yaw")):
            columns[f"{name}_deg"] = then(truth, label, turns=True)
    outputs, battery = tables.get("RCOU"), tables.get("BAT")
    if outputs is not None:
        for motor in range(1, 5):
            columns[f"motor_{motor}"] = np.clip(then(outputs, f"C{motor}") / 1000.0 - 1.0, 0.0, 1.0)
    if battery is not None:
        columns["volts"] = then(battery, "Volt")
    return {name: values.tolist() for name, values in columns.items()}


def _metres(origin_deg: tuple[float, float], lat_deg: Floats, lon_deg: Floats) -> tuple[Floats, Floats]:
    north = (lat_deg - origin_deg[0]) * M_PER_DEG
    return north, (lon_deg - origin_deg[1]) * (M_PER_DEG * math.cos(math.radians(origin_deg[0])))
