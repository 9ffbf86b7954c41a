"""What programs receive: drones, telemetry, operations. Plain immutable values; degrees, metres, seconds, volts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any


@dataclass(frozen=True, slots=True)
class User:
    id: int
    name: str

    @classmethod
    def of(cls, fields: Any) -> User | None:
        return None if fields is None else cls(fields["id"], fields["name"])


@dataclass(frozen=True, slots=True)
class DroneState:
    """A drone as the tower reports it. `armed`, `airborne`: None while unknown (a silent autopilot, an offline drone).
    `epoch` grows with each change of the controls. `hold_open`: it holds, and nobody has flown it since;
    `hold_words` says for people what it does. `offered`: an admin gives the controls back, and nobody accepted yet."""

    id: int
    name: str
    online: bool
    armed: bool | None
    airborne: bool | None
    holder: User | None
    epoch: int
    relation: str
    offered: bool
    hold_open: bool
    hold_words: str
    restraint: str = ""
    """`muted`, `limited` or `quarantined`, because it sends too much; empty: it is none of these."""

    @classmethod
    def of(cls, fields: Mapping[str, Any]) -> DroneState:
        hold = fields.get("hold") or {}
        return cls(
            id=fields["id"],
            name=fields["name"],
            online=fields["online"],
            armed=fields.get("armed"),
            airborne=fields.get("airborne"),
            holder=User.of(fields.get("holder")),
            epoch=fields["epoch"],
            relation=fields.get("relation", ""),
            offered=bool(fields.get("offered")),
            hold_open=bool(hold.get("open")),
            hold_words=hold.get("detail") or hold.get("waiting_for") or "",
            restraint=(fields.get("restraint") or {}).get("measure", ""),
        )


@dataclass(frozen=True, slots=True)
class Telemetry:
    """The newest state of a drone, of its autopilot's own messages. None: not heard yet, or not known to it.

    `heard_at_s`: of the newest message, by the clock of the event loop. `height_m` is above home, `altitude_m` above
    sea level. Velocities are over ground, metres a second. `heading_deg` is clockwise from north, `yaw_deg` the same
    from the attitude. `battery_percent`: what the autopilot believes to be left. `gps_fix`: GPS_FIX_TYPE, 3 is a
    position in space. `values`: NAMED_VALUE_FLOAT by name.
    """

    heard_at_s: float | None = None
    armed: bool | None = None
    mode: str | None = None
    lat_deg: float | None = None
    lon_deg: float | None = None
    altitude_m: float | None = None
    height_m: float | None = None
    north_m_s: float | None = None
    east_m_s: float | None = None
    down_m_s: float | None = None
    heading_deg: float | None = None
    roll_deg: float | None = None
    pitch_deg: float | None = None
    yaw_deg: float | None = None
    airspeed_m_s: float | None = None
    ground_speed_m_s: float | None = None
    throttle_percent: float | None = None
    battery_percent: float | None = None
    battery_v: float | None = None
    battery_a: float | None = None
    gps_fix: int | None = None
    satellites: int | None = None
    mission_item: int | None = None
    home_lat_deg: float | None = None
    home_lon_deg: float | None = None
    home_altitude_m: float | None = None
    values: Mapping[str, float] = field(default_factory=dict)

    @property
    def place(self) -> tuple[float, float] | None:
        """Latitude and longitude, once the autopilot has a position."""
        return None if self.lat_deg is None or self.lon_deg is None else (self.lat_deg, self.lon_deg)


@dataclass(frozen=True, slots=True)
class Operation:
    """Work at a drone (docs/api.md). `state`: `running`, `done`, `refused`, `failed`, `cancelled` or `timed_out`.
    `seen`: whether telemetry showed the effect; None: there is nothing to see."""

    id: str
    drone_id: int
    work: str
    state: str
    phase: str
    words: str
    item: int | None
    code: str
    seen: bool | None

    @classmethod
    def of(cls, fields: Mapping[str, Any]) -> Operation:
        return cls(
            id=fields["id"],
            drone_id=fields["drone_id"],
            work=fields["work"],
            state=fields["state"],
            phase=fields.get("phase", ""),
            words=fields.get("words", ""),
            item=fields.get("item"),
            code=fields.get("code", ""),
            seen=fields.get("seen"),
        )

    @property
    def over(self) -> bool:
        return self.state != "running"


class LossCause(StrEnum):
    """Why a program does not fly a drone any more."""

    TAKEN = "taken"
    """Somebody else has the controls, or nobody: TAKE, a release elsewhere, a revoked right."""
    HELD = "held"
    """The drone was made to hold. Its program may still have the controls, and may begin again."""
    TOWER_LOST = "tower-lost"
    """The tower was out of reach for longer than it waits for a holder."""
    DRONE_LOST = "drone-lost"
    """The drone has been offline for longer than the program accepts."""
    SIGNED_OUT = "signed-out"
    """The tower has ended the token."""


@dataclass(frozen=True, slots=True)
class Loss:
    """`words`: for people. `still_holder`: the program has the controls nevertheless."""

    cause: LossCause
    words: str
    still_holder: bool = False
