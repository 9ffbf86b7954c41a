"""The tower's events as typed values. Pure: parsed JSON in, values out. Unknown events become `OtherEvent`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from control_tower.values import DroneState, Operation, User


@dataclass(frozen=True, slots=True)
class Event:
    """`drone_id`: None if the event is about no single drone."""

    drone_id: int | None


@dataclass(frozen=True, slots=True)
class DroneChanged(Event):
    """A drone appeared, or its state changed."""

    state: DroneState


@dataclass(frozen=True, slots=True)
class DroneRemoved(Event):
    """The user may not see this drone any more."""


@dataclass(frozen=True, slots=True)
class ControlChanged(Event):
    """`change`: `acquired` `released` `taken` `given` `accepted` `assisting` `assist_ended` `revoked` `expired`."""

    change: str
    epoch: int
    holder: User | None
    by: User | None
    reason: str


@dataclass(frozen=True, slots=True)
class HoldStep(Event):
    """`step`: `ordered` `sticks_centred` `mode_requested` `mode_acknowledged` `confirmed` `not_needed` `unconfirmed`.
    `cause`: `order`, `pilot-lost` or `sticks-stale`."""

    epoch: int
    step: str
    detail: str
    cause: str


@dataclass(frozen=True, slots=True)
class OperationChanged(Event):
    operation: Operation


@dataclass(frozen=True, slots=True)
class Notice(Event):
    """The answer to something that this program did. `severity`: `info`, `warning` or `error`."""

    severity: str
    code: str
    text: str
    count: int


@dataclass(frozen=True, slots=True)
class AlertChanged(Event):
    """An alert was opened, changed, acknowledged or closed (docs/alerts.md). One about the tower has no drone."""

    alert_id: int
    rule: str
    severity: str
    words: str
    is_open: bool


@dataclass(frozen=True, slots=True)
class StatusText(Event):
    """What the autopilot says. `severity`: MAV_SEVERITY, 0 is an emergency, 6 is information."""

    severity: int
    text: str


@dataclass(frozen=True, slots=True)
class Connected(Event):
    """The live channel is open, and the tower has sent its whole state."""


@dataclass(frozen=True, slots=True)
class OtherEvent(Event):
    """An event that this version has no type for."""

    kind: str
    fields: Mapping[str, Any]


def parse(fields: Mapping[str, Any]) -> Event:
    """Returns the event of a text message. Raises KeyError or TypeError for a message that lacks what it must have."""
    kind, drone_id = fields["type"], fields.get("drone_id")
    match kind:
        case "drone":
            state = DroneState.of(fields["drone"])
            return DroneChanged(state.id, state)
        case "drone_removed":
            return DroneRemoved(drone_id)
        case "control":
            holder, by = User.of(fields["holder"]), User.of(fields["by"])
            return ControlChanged(drone_id, fields["event"], fields["epoch"], holder, by, fields["reason"])
        case "hold":
            return HoldStep(drone_id, fields["epoch"], fields["step"], fields["detail"], fields["cause"])
        case "operation":
            operation = Operation.of(fields["operation"])
            return OperationChanged(operation.drone_id, operation)
        case "notice":
            return Notice(drone_id, fields["severity"], fields["code"], fields["text"], fields["count"])
        case "alert":
            alert = fields["alert"]
            return AlertChanged(
                alert["drone_id"],
                alert["id"],
                alert["rule"],
                alert["severity"],
                alert["words"],
                alert["closed_at"] is None,
            )
        case _:
            return OtherEvent(drone_id, kind, fields)
