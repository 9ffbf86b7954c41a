"""Which stick moves which axis, and the columns of a flight that say so: from the black box's CSV or from a `.tlog`.
Pure.

Sticks are those of MANUAL_CONTROL, else RC channels 1 to 4 as ArduPilot and PX4 have them by default (roll, pitch,
throttle, yaw). The drone's answer is the angle for roll and pitch, the rate for yaw and climb: what a stick commands in
a mode that keeps its attitude. In a mode in which sticks command something else, the fit says so by a low r².
"""

from __future__ import annotations

import csv
import math
from array import array
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from struct import Struct
from typing import Final

import numpy as np

from server.flights.core.tlog import Entry
from server.identification.core.first_order import FirstOrder, Manoeuvre, Samples, fit, manoeuvres_in
from wire.dialect import mavlink
from wire.frames import message_id, payload, source

MAX_ROWS: Final = 500_000
"""An hour and more at 100 Hz."""
_NAN: Final = math.nan
_COLUMNS: Final = (
    "time_s",
    "roll_deg",
    "pitch_deg",
    "yaw_rate_deg_s",
    "down_m_s",
    "stick_y",
    "stick_x",
    "stick_r",
    "stick_z",
    "rc1",
    "rc2",
    "rc4",
    "rc3",
)
"""As the black box names them."""


class NoColumns(ValueError):
    """The file is no flight as a table."""


@dataclass(frozen=True)
class Axis:
    """`sign`: what makes the answer positive for what pilots call positive (climb is up)."""

    name: str
    unit: str
    answer: str
    stick: str
    channel: str
    sign: float = 1.0


AXES: Final = (
    Axis("roll", "deg", "roll_deg", "stick_y", "rc1"),
    Axis("pitch", "deg", "pitch_deg", "stick_x", "rc2"),
    Axis("yaw", "deg/s", "yaw_rate_deg_s", "stick_r", "rc4"),
    Axis("climb", "m/s", "down_m_s", "stick_z", "rc3", sign=-1.0),
)


@dataclass
class FlightTable:
    """The columns of `_COLUMNS`, a row for each attitude; NaN: not known."""

    columns: dict[str, array[float]] = field(default_factory=lambda: {name: array("d") for name in _COLUMNS})

    @property
    def rows(self) -> int:
        return len(self.columns["time_s"])

    def add(self, row: dict[str, float]) -> None:
        """What is not in the row is not known."""
        if self.rows < MAX_ROWS:
            for name, column in self.columns.items():
                column.append(row.get(name, _NAN))

    def column(self, name: str) -> Samples:
        return np.frombuffer(self.columns[name], dtype=np.float64) if self.rows else np.empty(0)


def identify(table: FlightTable) -> dict[str, FirstOrder | None]:
    """Returns the fit of each axis; None: its stick made no manoeuvre, or the drone did not move."""
    return {axis.name: fit(manoeuvres_of(table, axis)) for axis in AXES}


def manoeuvres_of(table: FlightTable, axis: Axis) -> list[Manoeuvre]:
    """What its stick did, and how the drone answered."""
    return manoeuvres_in(*_signals(table, axis))


def _signals(table: FlightTable, axis: Axis) -> tuple[Samples, Samples, Samples]:
    stick = table.column(axis.stick)
    if np.isnan(stick).all():
        given = (table.column(axis.channel) - 1500.0) / 500.0
    elif axis.stick == "stick_z":
        given = (stick - 500.0) / 500.0
    else:
        given = stick / 1000.0
    return table.column("time_s"), np.clip(given, -1.0, 1.0), axis.sign * table.column(axis.answer)


def table_of_csv(lines: Iterable[str]) -> FlightTable:
    """Reads the black box's CSV. Raises NoColumns."""
    reader = csv.DictReader(lines)
    names = reader.fieldnames or []
    missing = [name for name in _COLUMNS if name not in names]
    if missing:
        raise NoColumns(f"the table has no column {missing[0]}: it is not the CSV of a black box")
    table = FlightTable()
    for number, row in enumerate(reader, 2):
        try:
            table.add({name: float(row[name]) for name in _COLUMNS if row[name]})
        except ValueError:
            raise NoColumns(f"line {number} of the table is no row of numbers") from None
    return table


_ATTITUDE: Final = Struct("<Iffffff")
_POSITION: Final = Struct("<IiiiihhhH")
_MANUAL: Final = Struct("<hhhhH")
_CHANNELS: Final = Struct("<I4H")
_OVERRIDE: Final = Struct("<4H")
_ID_ATTITUDE: Final = mavlink.MAVLINK_MSG_ID_ATTITUDE
_ID_POSITION: Final = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
_ID_MANUAL: Final = mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL
_ID_CHANNELS: Final = mavlink.MAVLINK_MSG_ID_RC_CHANNELS
_ID_OVERRIDE: Final = mavlink.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE
_LAYOUTS: Final = {
    _ID_ATTITUDE: _ATTITUDE,
    _ID_POSITION: _POSITION,
    _ID_MANUAL: _MANUAL,
    _ID_CHANNELS: _CHANNELS,
    _ID_OVERRIDE: _OVERRIDE,
}
_FROM_GROUND: Final = (_ID_MANUAL, _ID_OVERRIDE)


def table_of_tlog(entries: Iterator[Entry]) -> FlightTable:
    """Reads a flight as the tower recorded it: its delays contain the link in both directions."""
    table, row = FlightTable(), dict[str, float]()
    for entry in entries:
        kind = message_id(entry.frame)
        layout = _LAYOUTS.get(kind)
        from_autopilot = source(entry.frame)[1] == mavlink.MAV_COMP_ID_AUTOPILOT1
        if layout is None or from_autopilot is (kind in _FROM_GROUND):
            continue
        values = layout.unpack_from(payload(entry.frame).ljust(layout.size, b"\0"))
        if kind == _ID_ATTITUDE:
            roll, pitch, _, _, _, yaw_rate = (math.degrees(one) for one in values[1:7])
            row |= {"time_s": entry.at_us / 1e6, "roll_deg": roll, "pitch_deg": pitch, "yaw_rate_deg_s": yaw_rate}
            table.add(row)
        elif kind == _ID_POSITION:
            row["down_m_s"] = values[7] / 100
        elif kind == _ID_MANUAL:
            names = ("stick_x", "stick_y", "stick_z", "stick_r")
            row |= {name: float(one) for name, one in zip(names, values, strict=False)}
        else:
            channels = values[-4:]
            row |= {f"rc{number}": float(one) for number, one in enumerate(channels, 1)}
    return table
