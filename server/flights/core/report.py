"""The report of a flight for people: one HTML page without any other file, to read, to print, or to keep as PDF. Pure.

It says what the index of the flight says (docs/flights.md): who had the controls, commands with their answers, holds
with their steps, alerts, the link, and everything that people were told, in order of time. Every text of a person is
escaped.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from html import escape
from typing import Any, Final

from server.flights.core.holds import holds_in
from server.flights.core.report_style import STYLE
from server.flights.core.report_words import command_words, name_of, told_words
from server.flights.core.track_picture import track_picture
from server.flights.core.views import FlightVideoView, FlightView

Entry = dict[str, Any]
"""A line of the index."""
MAX_ROWS: Final = 5000
"""Of one table. A page with more cannot be printed."""
NOBODY: Final = "nobody"


def report(
    flight: FlightView,
    index: Sequence[Entry],
    video: Sequence[FlightVideoView] = (),
    *,
    is_whole: bool,
    made_at: datetime,
    made_for: str,
) -> str:
    """`index`: in order of time. `video`: recordings that the reader may see. `made_for`: the name of the user who
    asked."""
    began_us = _us(flight.began_at)
    ended_us = _us(flight.ended_at or flight.began_at)
    title = f"Flight report: {flight.drone}, {_moment(began_us)} UTC"
    parts = [
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width">',
        f"<title>{escape(title)}</title><style>{STYLE}</style></head><body>",
        f"<h1>{escape(title)}</h1>",
        _summary(flight),
        track_picture(flight.track),
        _table("Who had the controls", ("From", "Until", "Person"), _holders(index, began_us, ended_us)),
        _table("Commands", ("Time", "After arming", "Person", "Command", "Answer"), _commands(index, began_us)),
        _holds(index, began_us),
        _table("Alerts", ("Time", "After arming", "Severity", "State", "Alert"), _alerts(index, began_us)),
        _table("Video", ("First picture", "After arming", "Until", "Recording"), _videos(video, began_us)),
        _table("Link", ("Time", "After arming", "What"), _link(index, began_us)),
        _table(
            f"Timeline: what people who may see {flight.drone} were told, and what happened",
            ("Time", "After arming", "What"),
            _timeline(index, began_us, flight.drone),
        ),
        f"<footer>Made at {_moment(_us(made_at))} UTC for {escape(made_for)} from the index of "
        f"flight {flight.id}. Times are UTC, by the clock of the tower.",
        "" if is_whole else " The index is not whole: more happened than the tower kept.",
        "</footer></body></html>\n",
    ]
    return "".join(parts)


def _summary(flight: FlightView) -> str:
    rows = {
        "Drone": flight.drone,
        "Armed": f"{flight.began_at.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC",
        "Ended": "not yet" if flight.ended_at is None else f"{flight.ended_at.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC",
        "Duration": "" if flight.duration_s is None else _length(flight.duration_s),
        "Distance over ground": "" if flight.distance_m is None else f"{flight.distance_m:.0f} m",
        "Greatest height above home": "" if flight.max_height_m is None else f"{flight.max_height_m:.1f} m",
        "Had the controls": ", ".join(pilot.name for pilot in flight.pilots) or NOBODY,
        "Frames": f"{flight.frames} recorded" + (f", {flight.lost_frames} missing" if flight.lost_frames else ""),
        "Note": flight.words,
    }
    cells = "".join(f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>" for name, value in rows.items() if value)
    return f"<dl>{cells}</dl>"


def _holders(index: Iterable[Entry], began_us: int, ended_us: int) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    holder, since = NOBODY, began_us
    for entry in index:
        if entry.get("kind") not in ("armed", "control"):
            continue
        name = name_of(entry.get("holder")) or NOBODY
        at_us = _at(entry)
        if name == holder:
            continue
        if at_us > since:
            rows.append((_moment(since), _moment(at_us), holder))
        holder, since = name, at_us
    rows.append((_moment(since), _moment(max(since, ended_us)), holder))
    return rows


def _commands(index: Iterable[Entry], began_us: int) -> list[tuple[str, ...]]:
    """One row each: an operation is in the index when it begins and when it ends."""
    found: dict[object, tuple[int, Entry]] = {}
    for number, entry in enumerate(index):
        if entry.get("kind") == "command":
            key = entry.get("operation") or number
            first_us = found[key][0] if key in found else _at(entry)
            found[key] = first_us, entry
    return [
        (*_times(at_us, began_us), name_of(entry.get("by")) or "the tower", command_words(entry), _answer(entry))
        for at_us, entry in found.values()
    ]


def _answer(entry: Entry) -> str:
    return str(entry.get("answer") or entry.get("state") or "")


def _holds(index: Iterable[Entry], began_us: int) -> str:
    holds = holds_in(index)
    if not holds:
        return _table("Holds", (), [])
    tables = []
    for number, steps in enumerate(holds, 1):
        rows = [
            (*_times(_at(step), began_us), f"{float(step.get('elapsed_ms') or 0):.0f} ms", told_words(step, ""))
            for step in steps
        ]
        tables.append(_table(f"Hold {number}", ("Time", "After arming", "After the order", "Step"), rows))
    return "".join(tables)


def _alerts(index: Iterable[Entry], began_us: int) -> list[tuple[str, ...]]:
    return [
        (
            *_times(_at(entry), began_us),
            str(entry.get("severity", "")),
            " by ".join(filter(None, (str(entry.get("state", "")), name_of(entry.get("by"))))),
            str(entry.get("words") or entry.get("what") or ""),
        )
        for entry in index
        if entry.get("kind") == "alert"
    ]


def _videos(video: Iterable[FlightVideoView], began_us: int) -> list[tuple[str, ...]]:
    """In order of their first pictures. A recording of which that is not known counts from its beginning."""
    return [
        (
            *_times(_us(one.shows_from), began_us),
            "not yet" if one.ended_at is None else _moment(_us(one.ended_at)),
            f"{one.id}, {one.quality} quality" + ("" if one.first_picture_at else ", first picture not known"),
        )
        for one in sorted(video, key=lambda one: (one.shows_from, one.id))
    ]


def _link(index: Sequence[Entry], began_us: int) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = [
        (*_times(_at(entry), began_us), "not heard any more" if entry["kind"] == "link_lost" else "heard again")
        for entry in index
        if entry.get("kind") in ("link_lost", "link_back")
    ]
    measured = [entry for entry in index if entry.get("kind") == "link"]
    worst = max(measured, key=lambda entry: float(entry.get("rtt_ms") or 0), default=None)
    if worst is not None and worst.get("rtt_ms"):
        rows.append((*_times(_at(worst), began_us), f"longest round trip: {float(worst['rtt_ms']):.0f} ms"))
    lossy = max(measured, key=lambda entry: float(entry.get("loss") or 0), default=None)
    if lossy is not None and lossy.get("loss"):
        rows.append((*_times(_at(lossy), began_us), f"greatest loss: {100 * float(lossy['loss']):.0f} %"))
    return rows


def _timeline(index: Iterable[Entry], began_us: int, drone: str) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for entry in index:
        words = told_words(entry, drone)
        if words:
            rows.append((*_times(_at(entry), began_us), words))
    return rows


def _table(title: str, heads: Sequence[str], rows: Sequence[tuple[str, ...]]) -> str:
    if not rows:
        return f"<h2>{escape(title)}</h2><p>None.</p>"
    head = "".join(f'<th scope="col">{escape(one)}</th>' for one in heads)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>\n" for row in rows[:MAX_ROWS])
    more = f"<p>{len(rows) - MAX_ROWS} more are not shown.</p>" if len(rows) > MAX_ROWS else ""
    return f"<h2>{escape(title)}</h2><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{more}"


def _at(entry: Entry) -> int:
    at_us = entry.get("at_us")
    return at_us if isinstance(at_us, int) else 0


def _us(at: datetime) -> int:
    return round(at.timestamp() * 1e6)


def _times(at_us: int, began_us: int) -> tuple[str, str]:
    after_s = (at_us - began_us) / 1e6
    return _moment(at_us), f"{'−' if after_s < 0 else ''}{_length(abs(after_s))}"


def _moment(at_us: int) -> str:
    return f"{datetime.fromtimestamp(at_us // 1000 / 1000, UTC):%Y-%m-%d %H:%M:%S.%f}"[:-3]


def _length(seconds: float) -> str:
    minutes, rest = divmod(seconds, 60)
    hours, minutes = divmod(int(minutes), 60)
    return f"{hours}:{minutes:02}:{rest:04.1f}" if hours else f"{minutes}:{rest:04.1f}"
