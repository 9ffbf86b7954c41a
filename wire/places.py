"""A place on earth from the integers of MAVLink (no I/O). Judged here alone: what is none goes into no message."""

_MOST_LAT_E7 = 900_000_000
_MOST_LON_E7 = 1_800_000_000


def place_of(lat_e7: int, lon_e7: int) -> tuple[float, float] | None:
    """Latitude and longitude in degrees, from degrees times 10^7.

    None for exactly 0, 0, which an autopilot without a fix reports, and for what is on no earth, which one with a
    broken estimator does.
    """
    if not (lat_e7 or lon_e7) or abs(lat_e7) > _MOST_LAT_E7 or abs(lon_e7) > _MOST_LON_E7:
        return None
    return lat_e7 / 1e7, lon_e7 / 1e7
