"""The telemetry profiles, and the rate of each message in them. One table, no logic.

`full` is everything as the autopilot sends it. `thin` is for a weak cellular link: enough for a usable console.
`minimal` is a map, a height, a battery and a mode, for less than a kilobyte per second including all overhead. The
rates are limits for state messages (`wire.state_messages`), of which only the newest counts; HEARTBEAT and
transactional messages are never thinned.
"""

from enum import StrEnum
from typing import Final, NamedTuple

from wire.dialect import mavlink

BEAT_S: Final = 0.2
"""Thinned messages leave together at fixed ticks: one datagram instead of many. Rates are fractions of this rate."""


class StreamProfile(StrEnum):
    """Amount of telemetry."""

    FULL = "full"
    THIN = "thin"
    MINIMAL = "minimal"


class StreamChoice(StrEnum):
    """The admin's choice: a profile, or `auto`, by which the agent adapts to the link."""

    AUTO = "auto"
    FULL = "full"
    THIN = "thin"
    MINIMAL = "minimal"


class Rates(NamedTuple):
    """Maximum rate of one message; at least `by_hand_hz` while the drone is flown by hand through the tower."""

    thin_hz: float
    minimal_hz: float
    by_hand_hz: float = 0.0


# By hand: the attitude for the horizon; position, height and climb for everything else; the rest so that the pilot sees
# trouble coming. Ground stations request about 4 and 2 Hz of the first two over a telemetry radio.
_RATES: Final = {
    "ATTITUDE": Rates(2.5, 1.0, 5.0),
    "GLOBAL_POSITION_INT": Rates(2.5, 1.0, 5.0),
    "LOCAL_POSITION_NED": Rates(1.0, 0.1),
    "VFR_HUD": Rates(1.0, 0.2, 2.5),
    "EXTENDED_SYS_STATE": Rates(1.0, 0.2, 1.0),
    "SYS_STATUS": Rates(0.5, 0.2, 0.5),
    "BATTERY_STATUS": Rates(0.2, 0.1, 0.2),
    "GPS_RAW_INT": Rates(0.5, 0.2, 0.5),
    "GPS2_RAW": Rates(0.5, 0.1, 0.5),
    "EKF_STATUS_REPORT": Rates(0.5, 0.1, 0.5),
    "ESTIMATOR_STATUS": Rates(0.5, 0.1, 0.5),
    "RC_CHANNELS": Rates(0.5, 0.1, 1.0),
    "DISTANCE_SENSOR": Rates(1.0, 0.1, 2.5),
    "MISSION_CURRENT": Rates(0.5, 0.2),
    "HOME_POSITION": Rates(0.1, 0.1),
    "ADSB_VEHICLE": Rates(1.0, 0.2, 1.0),
}

OTHERS: Final = Rates(0.5, 0.1)
"""Every other state message: none stops altogether."""

_BY_ID: Final = {getattr(mavlink, f"MAVLINK_MSG_ID_{name}"): rates for name, rates in _RATES.items()}


def rate_hz(profile: StreamProfile, message_id: int, *, by_hand: bool) -> float:
    """Returns the maximum rate of one sender's state message; infinity in `full`."""
    if profile is StreamProfile.FULL:
        return float("inf")
    rates = _BY_ID.get(message_id, OTHERS)
    rate = rates.thin_hz if profile is StreamProfile.THIN else rates.minimal_hz
    return max(rate, rates.by_hand_hz) if by_hand else rate


def beats_between(profile: StreamProfile, message_id: int, *, by_hand: bool) -> int:
    """Sends one frame every this many ticks; 0 in `full`, which sends at once."""
    return round(1.0 / (BEAT_S * rate_hz(profile, message_id, by_hand=by_hand)))
