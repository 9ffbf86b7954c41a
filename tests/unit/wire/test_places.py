"""What is a place on earth, and what an autopilot sends that is none."""

import pytest

from wire.places import place_of


@pytest.mark.parametrize(
    ("lat_e7", "lon_e7", "place"),
    [
        (473_977_000, 85_456_000, (47.3977, 8.5456)),
        (900_000_000, 1_800_000_000, (90.0, 180.0)),
        (-900_000_000, -1_800_000_000, (-90.0, -180.0)),
        (0, 1, (0.0, 1e-7)),
        (0, 0, None),
        (950_000_000, 85_456_000, None),
        (473_977_000, 1_800_000_001, None),
        (2**31 - 1, -(2**31), None),
    ],
)
def test_only_a_place_on_earth_is_one(lat_e7: int, lon_e7: int, place: tuple[float, float] | None) -> None:
    assert place_of(lat_e7, lon_e7) == place
