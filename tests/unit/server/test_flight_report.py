"""The report of a flight: everything of the index is in it, in order, and no text of a person is markup."""

import re
from datetime import UTC, datetime, timedelta
from html.parser import HTMLParser
from typing import Any

from server.flights.core.report import report
from server.flights.core.views import FlightVideoView, FlightView, PilotView

BEGAN = datetime(2026, 3, 4, 5, 6, 7, tzinfo=UTC)
ALICE = {"id": 1, "name": "alice"}
BOSS = {"id": 2, "name": "<script>alert(1)</script>"}
TAKE_OFF = {"kind": "command", "operation": "op", "about": "take-off to 40 m", "by": ALICE, "way": "operation"}


def at(seconds: float, kind: str, **about: Any) -> dict[str, Any]:
    return {"at_us": round(BEGAN.timestamp() * 1e6 + seconds * 1e6), "kind": kind, **about}


INDEX = [
    at(0, "armed", holder=ALICE),
    {**at(2, "command"), **TAKE_OFF, "state": "running", "answer": ""},
    {**at(2.4, "command"), **TAKE_OFF, "state": "done", "answer": "accepted"},
    at(10, "sticks", by=ALICE),
    at(20, "control", event="taken", holder=BOSS, by=BOSS, reason="airspace closed"),
    at(20.01, "hold", step="ordered", detail="taken", elapsed_ms=0.0, epoch=5, cause="order"),
    at(20.3, "hold", step="confirmed", detail="ALT_HOLD", elapsed_ms=290.0, epoch=5, cause="order"),
    at(30, "alert", what="battery-low", severity="warning", state="opened", words="Battery low"),
    at(31, "alert", what="battery-low", severity="warning", state="acknowledged", words="Battery low", by=ALICE),
    at(35, "link", rtt_ms=480.0, loss=0.25, transport="udp", uplinks=1),
    at(40, "link_lost"),
    at(43, "link_back"),
    at(44, "notice", text="Somebody else's drone is near", severity="warning"),
    at(45, "a-kind-of-later"),
    at(60, "disarmed"),
]


def made(index: list[dict[str, Any]], video: list[FlightVideoView] | None = None, **change: Any) -> str:
    flight = FlightView(
        id=9,
        drone_id=1,
        drone='Kestrel "A&B"',
        pilots=[PilotView(id=1, name="alice")],
        state="ready",
        words="",
        began_at=BEGAN,
        ended_at=BEGAN + timedelta(seconds=60),
        duration_s=60.0,
        distance_m=656.4,
        max_height_m=40.0,
        track=[(47.0, 8.0), (47.001, 8.0), (47.001, 8.001)],
        frames=3000,
        lost_frames=2,
        size_bytes=10,
    ).model_copy(update=change)
    return report(flight, index, video or [], is_whole=True, made_at=BEGAN + timedelta(days=1), made_for="admin")


class Page(HTMLParser):
    """The tags, and the rows of the tables."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.addresses: list[str] = []
        self.rows: list[list[str]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.addresses += [value or "" for name, value in attrs if name in ("src", "href")]
        if tag == "tr":
            self.rows.append([])
        if tag == "td":
            self.rows[-1].append("")

    def handle_data(self, data: str) -> None:
        if self.rows and self.rows[-1] and self.get_starttag_text() == "<td>":
            self.rows[-1][-1] += data.rstrip("\n")


def test_the_report_says_what_happened_in_order() -> None:
    page = Page(made(INDEX))
    rows = [row for row in page.rows if row]
    assert ["2026-03-04 05:06:07.000", "2026-03-04 05:06:27.000", "alice"] in rows
    assert ["2026-03-04 05:06:27.000", "2026-03-04 05:07:07.000", BOSS["name"]] in rows
    assert ["2026-03-04 05:06:09.000", "0:02.0", "alice", "take-off to 40 m", "accepted"] in rows
    assert ["2026-03-04 05:06:27.300", "0:20.3", "290 ms", "Hold confirmed by the autopilot: ALT_HOLD"] in rows
    assert ["2026-03-04 05:06:38.000", "0:31.0", "warning", "acknowledged by alice", "Battery low"] in rows
    assert ["2026-03-04 05:06:42.000", "0:35.0", "longest round trip: 480 ms"] in rows
    told = [row[2] for row in rows if len(row) == 3]
    timeline = told[told.index('Kestrel "A&B" armed; alice has the controls') :]
    assert timeline == [
        'Kestrel "A&B" armed; alice has the controls',
        "alice: take-off to 40 m (running)",
        "alice: take-off to 40 m (accepted)",
        "alice moves the sticks",
        f'{BOSS["name"]} TOOK control of Kestrel "A&B": airspace closed; {BOSS["name"]} has the controls',
        "Hold ordered (ordered by the tower): taken",
        "Hold confirmed by the autopilot: ALT_HOLD",
        "Alert opened: Battery low",
        "Alert acknowledged by alice: Battery low",
        'Kestrel "A&B" was not heard any more',
        'Kestrel "A&B" was heard again',
        "Somebody else's drone is near",
        'Kestrel "A&B" disarmed',
    ]


def test_a_recording_is_placed_by_its_first_picture() -> None:
    begun = {"id": 4, "quality": "high", "state": "ready", "ended_at": BEGAN + timedelta(seconds=50)}
    late = FlightVideoView(began_at=BEGAN, first_picture_at=BEGAN + timedelta(seconds=12.25), **begun)
    old = FlightVideoView(**late.model_dump() | {"id": 3, "began_at": BEGAN + timedelta(seconds=7)})
    old = old.model_copy(update={"first_picture_at": None})
    going_on = late.model_copy(update={"id": 5, "began_at": BEGAN - timedelta(seconds=2), "ended_at": None})
    rows = [row for row in Page(made([], [late, old, going_on])).rows if "quality" in "".join(row)]
    assert rows == [
        ["2026-03-04 05:06:14.000", "0:07.0", "2026-03-04 05:06:57.000", "3, high quality, first picture not known"],
        ["2026-03-04 05:06:19.250", "0:12.2", "2026-03-04 05:06:57.000", "4, high quality"],
        ["2026-03-04 05:06:19.250", "0:12.2", "not yet", "5, high quality"],
    ]


def test_the_report_needs_no_other_file_and_runs_nothing() -> None:
    text = made(INDEX)
    page = Page(text)
    assert "script" not in page.tags and not page.addresses
    assert not re.search(r"url\(|@import|https?:", text)
    assert "<script>" not in text and "&lt;script&gt;" in text


def test_a_flight_of_which_nothing_was_noted_is_a_report_too() -> None:
    text = made([], track=[], distance_m=None, max_height_m=None, pilots=[])
    assert text.count("<p>None.</p>") == 6  # commands, holds, alerts, video, link, timeline
    assert "nobody" in text and "<svg" not in text
