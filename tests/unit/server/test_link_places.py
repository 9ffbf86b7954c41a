"""Quality of links by place: which cell a report belongs to, and what a cell says."""

import csv
import io
import json
import math
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import pytest

from server.flights.core import link_places
from server.flights.core.link_places import METRES_PER_DEGREE, LinkPlaces, LinkPlacesView, link_places_csv
from server.flights.core.link_report import MAX_AGE_S, place_of
from wire.dialect import build, mavlink

LAT, LON = 47.3977, 8.5456


def line(kind: str = "link", **about: Any) -> bytes:
    return json.dumps({"at_us": 1, "kind": kind, **about}).encode()


def report(lat: float, lon: float, rtt_ms: float | None = 50.0, loss: float | None = 0.0) -> bytes:
    return line(lat=lat, lon=lon, rtt_ms=rtt_ms, loss=loss)


def view_of(*flights: list[bytes], cell_m: float = 100.0) -> LinkPlacesView:
    places = LinkPlaces(cell_m)
    for lines in flights:
        places.take(lines)
    return places.view()


def test_a_cell_sums_up_what_was_reported_in_it() -> None:
    view = view_of(
        [report(LAT, LON, 40, 0.0), report(LAT, LON, 50, 0.1), line("link_lost", lat=LAT, lon=LON)],
        [report(LAT, LON, 900, None), report(LAT, LON, None, 0.2)],
        [line("link", rtt_ms=1.0, loss=1.0), line("alert", what="link"), b"{torn", line("link_back", lat=LAT, lon=LON)],
    )
    (feature,) = view.features
    about = feature.properties
    assert (about.reports, about.losses, about.loss_mean) == (4, 1, pytest.approx(0.1))
    assert (about.rtt_median_ms, about.rtt_max_ms) == (50, 900)
    assert (view.flights, view.is_whole) == (2, True)


@pytest.mark.parametrize("lat", [0.0, LAT, -33.9, 69.6])
@pytest.mark.parametrize("cell_m", [50.0, 100.0, 1000.0])
def test_cells_are_squares_that_contain_their_reports(lat: float, cell_m: float) -> None:
    (feature,) = view_of([report(lat, LON)], cell_m=cell_m).features
    ring = feature.geometry.coordinates[0]
    assert ring[0] == ring[-1] and len(ring) == 5
    (west, south), (east, north) = ring[0], ring[2]
    assert west <= LON <= east and south <= lat <= north
    assert (north - south) * METRES_PER_DEGREE == pytest.approx(cell_m, rel=0.01)
    wide_m = (east - west) * METRES_PER_DEGREE * math.cos(math.radians(lat))
    assert wide_m == pytest.approx(cell_m, rel=0.03)
    # Counter-clockwise, as RFC 7946 has it.
    area = sum(a[0] * b[1] - b[0] * a[1] for a, b in pairwise(ring))
    assert area > 0


def test_places_that_are_none_and_edges_of_the_world() -> None:
    assert view_of([report(91.0, 0.0), report(0.0, 181.0)]).features == []
    for lat, lon in ((90.0, 0.0), (-90.0, 0.0), (0.0, 180.0), (0.0, -180.0)):
        (feature,) = view_of([report(lat, lon)]).features
        assert all(abs(x) <= 180 and abs(y) <= 90 for x, y in feature.geometry.coordinates[0])


def test_cells_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(link_places, "MAX_CELLS", 2)
    monkeypatch.setattr(link_places, "MAX_TIMES", 2)
    view = view_of([report(LAT + step * 0.01, LON, rtt) for rtt in (10, 30, 5000) for step in range(3)])
    assert (len(view.features), view.is_whole) == (2, False)
    about = view.features[0].properties
    assert (about.reports, about.rtt_median_ms, about.rtt_max_ms) == (3, 20, 5000)


def test_csv_has_a_row_for_each_cell() -> None:
    view = view_of([report(LAT, LON, 40, 0.5), report(LAT + 0.01, LON, None, None)])
    rows = list(csv.DictReader(io.StringIO(link_places_csv(view))))
    assert [(row["reports"], row["loss_mean"], row["rtt_median_ms"]) for row in rows] == [
        ("1", "0.5", "40.0"),
        ("1", "", ""),
    ]
    assert float(rows[0]["lat_deg"]) == pytest.approx(LAT, abs=0.001)
    assert float(rows[0]["lon_deg"]) == pytest.approx(LON, abs=0.001)


def test_the_place_of_a_report_is_not_older_than_the_report() -> None:
    frame = build(
        mavlink.MAVLink_global_position_int_message(0, 473_977_004, 85_456_004, 0, 0, 0, 0, 0, 0),
        system_id=1,
        component_id=1,
        sequence=0,
    )
    drone: Any = SimpleNamespace(position_frame=frame, position_at=100.0)
    here = {"lat": 47.3977, "lon": 8.5456}
    assert place_of(drone, 104.0, MAX_AGE_S) == here
    assert place_of(drone, 106.0, MAX_AGE_S) == {}
    assert place_of(drone, 106.0) == here, "a lost link is noticed late"
    assert place_of(drone, 131.0) == {}
    assert place_of(SimpleNamespace(position_frame=None, position_at=130.0), 131.0) == {}  # type: ignore[arg-type]
