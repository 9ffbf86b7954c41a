"""Sums of flights, log book and CSV: against sums made by hand."""

import csv
import io
from datetime import UTC, datetime, timedelta

import pytest

from server.flights.core.figures import FlightFigures, PilotShare
from server.flights.core.statistics import KeptFlight, log_book, statistics
from server.flights.core.statistics_csv import drones_csv, flights_csv, log_book_csv, pilots_csv

NAMES = {7: "kestrel", 8: "=cmd()"}
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def flight(
    number: int,
    began_at: datetime,
    *pilots: PilotShare,
    drone_id: int = 7,
    minutes: float = 30,
    air_minutes: float | None = 24,
    holds: int = 0,
    link_losses: int = 0,
    critical_alerts: int = 0,
    mah: float | None = 1000,
    height_m: float | None = 40,
    rtt_ms: float | None = 50,
) -> KeptFlight:
    began_us = (began_at - EPOCH) // timedelta(microseconds=1)
    figures = FlightFigures(
        began_us=began_us,
        ended_us=began_us + round(minutes * 60e6),
        air_s=None if air_minutes is None else air_minutes * 60,
        distance_m=2000.0,
        max_height_m=height_m,
        max_speed_m_s=12.0,
        battery_start_v=16.8,
        battery_end_v=14.9,
        used_mah=mah,
        landings=1,
        holds=holds,
        hand_overs=max(0, len(pilots) - 1),
        alerts=critical_alerts,
        critical_alerts=critical_alerts,
        link_losses=link_losses,
        link_lost_s=link_losses * 2.0,
        rtt_mean_ms=rtt_ms,
        rtt_max_ms=rtt_ms,
        loss_mean=0.01,
        pilots=pilots,
    )
    return KeptFlight(number, drone_id, began_at, figures)


def share(user_id: int | None, name: str, held_min: float, air_min: float | None, distance_m: float) -> PilotShare:
    air_s = None if air_min is None else air_min * 60
    return PilotShare(user_id, name, held_min * 60, air_s, distance_m, landings=1)


FLIGHTS = [
    # newest first; alice was called "al" before
    flight(4, datetime(2026, 6, 30, 23, 30, tzinfo=UTC), share(1, "alice", 30, 24, 2000), drone_id=8, holds=2),
    flight(
        3,
        datetime(2026, 6, 2, 9, tzinfo=UTC),
        share(1, "al", 10, 6, 500),
        share(2, "bob", 20, 18, 1500),
        link_losses=1,
        holds=1,
    ),
    flight(2, datetime(2026, 5, 9, tzinfo=UTC), share(None, "gone", 30, None, 2000), air_minutes=None, mah=None),
    flight(1, datetime(2026, 5, 1, tzinfo=UTC), share(2, "bob", 30, 24, 2000), mah=500, height_m=None, rtt_ms=None),
]


def test_sums_by_drone() -> None:
    view = statistics(FLIGHTS, NAMES, is_whole=True)
    assert (view.total.flights, view.total.hours) == (4, pytest.approx((24 + 24 + 30 + 24) / 60, abs=1e-4))
    assert (view.total.incidents, view.total.distance_m, view.total.landings) == (2, 8000, 4)
    kestrel, other = view.drones
    assert (kestrel.drone, kestrel.flights, kestrel.hours) == ("kestrel", 3, pytest.approx(1.3))
    assert (kestrel.used_mah, kestrel.holds, kestrel.link_losses, kestrel.link_lost_s) == (1500, 1, 1, 2.0)
    assert (kestrel.rtt_mean_ms, kestrel.max_height_m, kestrel.hand_overs) == (50, 40, 1)
    assert (other.drone_id, other.holds, other.incidents) == (8, 2, 1)


def test_sums_by_pilot_are_of_their_own_part() -> None:
    view = statistics(FLIGHTS, NAMES, is_whole=True)
    bob, alice, gone = view.pilots
    assert (bob.pilot.id, bob.flights, bob.hours, bob.distance_m) == (2, 2, pytest.approx(0.7), 3500)
    assert (alice.pilot.name, alice.hours, alice.held_hours) == ("alice", pytest.approx(0.5), pytest.approx(0.6667))
    assert (alice.incidents, bob.incidents, gone.incidents) == (2, 1, 0)
    assert (gone.pilot.id, gone.pilot.name, gone.hours) == (None, "gone", 0.5)


def test_sums_by_month_of_utc() -> None:
    months = statistics(FLIGHTS, NAMES, is_whole=True).months
    assert [(one.month, one.flights) for one in months] == [("2026-05", 2), ("2026-06", 2)]
    assert months[0].hours == pytest.approx(0.9)


def test_nothing_is_nothing() -> None:
    view = statistics([], NAMES, is_whole=True)
    assert (view.total.flights, view.total.max_height_m, view.drones, view.pilots) == (0, None, [], [])


def test_log_book_has_ones_own_part_only() -> None:
    book = log_book(FLIGHTS, 1, NAMES, is_whole=True)
    assert [one.flight_id for one in book.entries] == [4, 3]
    assert (book.total.hours, book.total.distance_m) == (pytest.approx(0.5), 2500)
    first, second = book.entries
    assert (first.with_others, second.with_others) == ([], ["bob"])
    assert (second.held_s, second.air_s, second.is_incident) == (600, 360, True)
    assert second.ended_at - second.began_at == timedelta(minutes=30)


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def test_csv_says_the_same() -> None:
    view = statistics(FLIGHTS, NAMES, is_whole=True)
    assert [(one["drone"], one["flights"]) for one in rows(drones_csv(view))] == [("kestrel", "3"), ("'=cmd()", "1")]
    pilots = rows(pilots_csv(view))
    assert [(one["pilot_id"], one["pilot"], one["distance_m"]) for one in pilots][2] == ("", "gone", "2000.0")
    flights = rows(flights_csv(FLIGHTS, NAMES))
    assert [one["pilots"] for one in flights] == ["alice", "al; bob", "gone", "bob"]
    assert (flights[2]["air_s"], flights[2]["duration_s"]) == ("", "1800.0")
    book = rows(log_book_csv(log_book(FLIGHTS, 1, NAMES, is_whole=True)))
    assert [(one["began_at"], one["is_incident"]) for one in book] == [
        ("2026-06-30T23:30:00+00:00", "1"),
        ("2026-06-02T09:00:00+00:00", "1"),
    ]


def test_csv_without_flights_has_a_line_of_names() -> None:
    assert rows(drones_csv(statistics([], NAMES, is_whole=True))) == []
    assert flights_csv([], NAMES).startswith("flight_id,began_at,drone_id,drone,pilots,")
