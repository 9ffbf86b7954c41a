"""What browsers are told of other aircraft."""

import msgspec


class AircraftView(msgspec.Struct, frozen=True):
    """An aircraft that is none of the tower's. Height above the sea; None: not known."""

    key: str
    manned: bool
    name: str
    lat: float
    lon: float
    alt_amsl_m: float | None
    course_deg: float | None
    speed_m_s: float | None
    climb_m_s: float
    squawk: int | None
    on_ground: bool
    age_s: float
    """Since it was heard there."""


class AircraftHeard(msgspec.Struct, frozen=True, tag="aircraft", tag_field="type"):
    """All aircraft near the drones that this browser sees, once a second while there are any; at last none."""

    aircraft: list[AircraftView]
