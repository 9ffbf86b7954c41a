"""The directions of a controller: what it can ask of the drone. Pure; no MAVLink, so that a controller starts fast.

Distances in metres, speeds in m/s, angles in degrees. Forward and right are relative to the nose, turns are clockwise
seen from above. Heights are above home.
"""

import msgspec

DEFAULT_SPEED_M_S = 2.0


class Move(msgspec.Struct, frozen=True, tag="move", tag_field="do"):
    """Fly with this velocity for `for_s`, at most MAX_MOVE_S; then the drone holds unless another direction came."""

    forward_m_s: float = 0.0
    right_m_s: float = 0.0
    up_m_s: float = 0.0
    turn_deg_s: float = 0.0
    for_s: float = 1.0


class Turn(msgspec.Struct, frozen=True, tag="turn", tag_field="do"):
    """Turn on the spot by this angle, -180 to 180."""

    by_deg: float


class GoBy(msgspec.Struct, frozen=True, tag="go_by", tag_field="do"):
    """Fly to a place relative to the present one and the nose. Without an end within `within_s` the drone holds."""

    forward_m: float = 0.0
    right_m: float = 0.0
    up_m: float = 0.0
    speed_m_s: float = DEFAULT_SPEED_M_S
    within_s: float = 60.0


class GoTo(msgspec.Struct, frozen=True, tag="go_to", tag_field="do"):
    """Fly to a place on the map."""

    lat_deg: float
    lon_deg: float
    height_m: float
    speed_m_s: float = DEFAULT_SPEED_M_S
    within_s: float = 60.0


class Hold(msgspec.Struct, frozen=True, tag="hold", tag_field="do"):
    """Stop, and keep the place."""


class TakeOff(msgspec.Struct, frozen=True, tag="take_off", tag_field="do"):
    """Arm and climb to this height. Refused unless the request to start the controller permits it."""

    height_m: float


class Land(msgspec.Struct, frozen=True, tag="land", tag_field="do"):
    """Land here. The autopilot does it alone, and the controller ends when the motors stop."""


class Drop(msgspec.Struct, frozen=True, tag="drop", tag_field="do"):
    """Let the payload go here, while the drone keeps its place. How is a setting of the agent (`payload_release`)."""


class Finish(msgspec.Struct, frozen=True, tag="finish", tag_field="do"):
    """The controller's work is done: the drone holds."""


Direction = Move | Turn | GoBy | GoTo | Hold | TakeOff | Land | Drop | Finish


def forward(m_s: float, for_s: float = 1.0) -> Move:
    """Returns the direction to fly along the nose; negative: back."""
    return Move(forward_m_s=m_s, for_s=for_s)


def left(m_s: float, for_s: float = 1.0) -> Move:
    """Returns the direction to fly to the left of the nose; negative: to its right."""
    return Move(right_m_s=-m_s, for_s=for_s)


def up(m_s: float, for_s: float = 1.0) -> Move:
    """Returns the direction to climb; negative: to descend."""
    return Move(up_m_s=m_s, for_s=for_s)
