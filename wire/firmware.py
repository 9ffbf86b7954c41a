"""The release of an autopilot's firmware, as AUTOPILOT_VERSION encodes it. Pure.

`flight_sw_version` has four bytes: major, minor, patch and the kind of build (0 development, 64 alpha, 128 beta, 192
release candidate, 255 official). 0: the autopilot does not say.
"""

from typing import Final

Release = tuple[int, int]
"""Major and minor number."""

_BETA: Final = 128
_BEFORE_THE_FIRST: Final = 99
_KINDS: Final = ((255, ""), (192, "-rc"), (_BETA, "-beta"), (64, "-alpha"), (0, "-dev"))


def release_of(flight_sw_version: int, *, counts_from_last: bool = False) -> Release | None:
    """The newest release whose features the firmware surely has; None: not known.

    A development build bears the number of the release to come, and may lack any of its features. `counts_from_last`:
    it bears that of the release that it has grown from (PX4, some commits after a tag).
    """
    if flight_sw_version == 0:
        return None
    major, minor, kind = flight_sw_version >> 24 & 0xFF, flight_sw_version >> 16 & 0xFF, flight_sw_version & 0xFF
    if kind >= _BETA or (kind == 0 and counts_from_last):
        return major, minor
    return (major, minor - 1) if minor else (major - 1, _BEFORE_THE_FIRST)


def firmware_words(flight_sw_version: int) -> str:
    """For people: `4.6.2`, `4.7.0-dev`. Empty: not known."""
    if flight_sw_version == 0:
        return ""
    major, minor, patch = (flight_sw_version >> shift & 0xFF for shift in (24, 16, 8))
    kind = next(word for least, word in _KINDS if flight_sw_version & 0xFF >= least)
    return f"{major}.{minor}.{patch}{kind}"
