"""`--traffic`: a simulated receiver hears the same few aircraft once a second, on circles around home."""

from math import hypot

from simulator.dialect import Codec
from simulator.flight_state import FlightSettings
from simulator.geodesy import Place
from simulator.vehicle import Vehicle, VehicleSettings

HOME = Place(47.0, 8.0, 500.0)


def heard(*, traffic: bool) -> list[object]:
    vehicle = Vehicle(VehicleSettings(FlightSettings(place=HOME, boot_s=0.5), traffic=traffic))
    vehicle.step(5.0)
    codec = Codec(255)
    messages = [one for datagram in vehicle.datagrams_to_send() for one in codec.decode(datagram)]
    return [one for one in messages if one.get_type() == "ADSB_VEHICLE"]


def test_aircraft_are_heard_once_a_second_around_home() -> None:
    assert heard(traffic=False) == []
    messages = heard(traffic=True)
    by_address: dict[int, list[object]] = {}
    for message in messages:
        by_address.setdefault(message.ICAO_address, []).append(message)  # type: ignore[attr-defined]
    assert len(by_address) == 3
    assert all(4 <= len(one) <= 6 for one in by_address.values())
    first = by_address[0x4B1901][0]
    north = (first.lat / 1e7 - HOME.lat_deg) * 111_319.5  # type: ignore[attr-defined]
    east = (first.lon / 1e7 - HOME.lon_deg) * 111_319.5 * 0.682  # type: ignore[attr-defined]
    assert abs(hypot(north, east) - 1_800) < 10
    assert first.altitude == 650_000  # type: ignore[attr-defined]
