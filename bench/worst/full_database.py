"""A database as large as a tower lets it become, or as years of use make it: what lists and searches have to read."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from typing import Any, Final

from sqlalchemy import Table, insert

from server.accounts.store.tables import ApiTokenRow, SessionRow, UserRow
from server.airspace.core.zones.zone import MAX_POINTS, MAX_ZONES
from server.airspace.store.tables import ZoneRow
from server.alerts.store.channels.tables import AlertChannelRow, AlertDeliveryRow
from server.alerts.store.tables import AlertRow
from server.audit.store.tables import AuditEventRow
from server.fleet.store.tables import EnrolmentRow, LoanRow, OwnershipRow
from server.flights.store.tables import FlightFiguresRow, FlightPilotRow, FlightRow, FlightShareRow
from server.plans.store.tables import MissionRow
from server.readiness.store.task_tables import MaintenanceTaskRow
from server.storage.database import Base, Database
from server.teams.store.tables import TeamDroneRow, TeamInvitationRow, TeamMemberRow, TeamRow
from server.video.store.tables import RecordingRow

USERS: Final = 300
DRONES: Final = 200
TEAMS: Final = 50
FLIGHTS: Final = 10_000
AT_ONCE: Final = 500
LAT, LON = 47.0, 8.0
_NOW: Final = datetime.now(UTC)
_LONG_NAME: Final = "W" * 50
TEAM, ZONE, MISSION = 1, 1, 1
PLAN: Final = [[16, 3, [0, 0, 0, None], 470_000_000 + 100 * n, 80_000_000, 50.5, 1] for n in range(724)]


def _ago(number: int) -> datetime:
    return _NOW - timedelta(minutes=7 * number)


def ring(number: int, points: int = MAX_POINTS) -> list[list[float]]:
    """The corners of a zone as airspaces are: many, not convex, and all zones over the same ground."""
    reach = 0.05 + 0.0005 * (number % 1000)
    turns = [2 * math.pi * at / points for at in range(points)]
    return [
        [round(LAT + (reach + 0.002 * (at % 2)) * math.sin(turn), 6),
         round(LON + (reach + 0.002 * (at % 2)) * math.cos(turn), 6)] for at, turn in enumerate(turns)
    ]  # fmt: skip


async def fill(database: Database) -> None:
    """Beside the users (an admin with id 1) and the drones, which are there already."""
    for table, rows in _tables():
        whole = list(rows)
        for first in range(0, len(whole), AT_ONCE):
            async with database.writing() as session:
                await session.execute(insert(table), whole[first : first + AT_ONCE])


def _tables() -> Iterator[tuple[type[Base] | Table, Iterator[dict[str, Any]]]]:
    yield UserRow, (
        {"name": f"{_LONG_NAME} {n}", "name_key": f"{_LONG_NAME} {n}".casefold(), "password_hash": "none",
         "role": "operator", "created_at": _ago(n)} for n in range(USERS)
    )  # fmt: skip
    owned = [(drone, user) for drone in range(1, DRONES + 1) for user in range(1, 11)]
    yield OwnershipRow, ({"drone_id": drone, "user_id": user} for drone, user in owned)
    yield (
        LoanRow,
        (
            {"drone_id": drone, "user_id": 20, "until": _NOW + timedelta(days=30), "may_arm": True}
            for drone in range(1, DRONES + 1)
        ),
    )
    yield EnrolmentRow, (
        {"drone_id": 1 + n % DRONES, "token_hash": f"{n:064}", "created_by": _LONG_NAME, "created_at": _ago(n),
         "expires_at": _NOW + timedelta(days=1)} for n in range(500)
    )  # fmt: skip
    yield TeamRow, ({"id": TEAM + n, "name": _LONG_NAME, "made_by": 1 + n, "created_at": _ago(n)} for n in range(TEAMS))
    yield (
        TeamMemberRow,
        ({"team_id": TEAM + n // 200, "user_id": 1 + n % 200, "role": "admin"} for n in range(200 * TEAMS)),
    )
    yield TeamDroneRow, ({"drone_id": n, "team_id": TEAM, "since": _NOW} for n in range(1, DRONES + 1))
    yield TeamInvitationRow, (
        {"id": 1 + n, "team_id": TEAM, "name": f"guest {n}", "name_key": f"guest {n}", "role": "operator",
         "invited_by": _LONG_NAME, "created_at": _NOW, "expires_at": _NOW + timedelta(days=7)} for n in range(50)
    )  # fmt: skip
    yield ZoneRow, (
        {"id": ZONE + n, "team_id": None, "name": f"{_LONG_NAME} {n}", "kind": "height-limit", "rule": "refuse",
         "points": json.dumps(ring(n)), "ceiling_m": 5000.0, "height_above": "home", "reason": "r" * 200,
         "made_by": _LONG_NAME, "updated_at": _ago(n)} for n in range(MAX_ZONES - 1)
    )  # fmt: skip
    document = json.dumps({"mission": PLAN, "fence": PLAN, "rally": PLAN[:100]})
    yield MissionRow, (
        {"owner_id": 1, "name": f"{_LONG_NAME} {n}", "document": document, "mission_items": 724, "fence_items": 724,
         "rally_items": 100, "updated_at": _ago(n)} for n in range(490)
    )  # fmt: skip
    track = [[LAT + 0.0001 * n, LON] for n in range(200)]
    yield FlightRow, (
        {"drone_id": 1 + n % DRONES, "store": "none", "file": f"{n:032}", "state": "ready", "began_at": _ago(n),
         "ended_at": _ago(n), "distance_m": 1000.0, "max_height_m": 50.0, "track": track} for n in range(FLIGHTS)
    )  # fmt: skip
    yield FlightPilotRow, (
        {"flight_id": 1 + n // 3, "number": n % 3, "user_id": 1 + n % 50, "name": _LONG_NAME,
         "name_key": _LONG_NAME.casefold()} for n in range(3 * FLIGHTS)
    )  # fmt: skip
    yield FlightFiguresRow, (
        {"flight_id": n + 1, "drone_id": 1 + n % DRONES, "began_at": _ago(n), "ended_at": _ago(n), "air_s": 600.0,
         "flown_s": 600.0, "distance_m": 1000.0, "max_height_m": 50.0, "max_speed_m_s": 9.5, "battery_start_v": 16.8,
         "battery_end_v": 14.9, "used_mah": 2100.0, "landings": 1, "holds": 2, "hand_overs": 1, "alerts": 3,
         "critical_alerts": 0, "link_losses": 0, "link_lost_s": 0.0} for n in range(FLIGHTS)
    )  # fmt: skip
    yield FlightShareRow, (
        {"flight_id": 1 + n // 3, "number": n % 3, "user_id": 1 + n % 50, "name": _LONG_NAME, "held_s": 200.0,
         "air_s": 200.0, "distance_m": 300.0, "landings": 0} for n in range(3 * FLIGHTS)
    )  # fmt: skip
    detail = {"words": "d" * 400, "before": {"name": _LONG_NAME}, "after": {"name": _LONG_NAME}}
    yield AuditEventRow, (
        {"at": _ago(n), "actor_id": 1, "actor_name": _LONG_NAME, "action": f"drone.changed{n % 40}", "drone_id": 1,
         "detail": detail, "address": "192.0.2.1", "request_id": f"{n:032}"} for n in range(20_000)
    )  # fmt: skip
    yield AlertRow, (
        {"id": 1 + n, "rule": "low-battery", "subject": f"drone {n}", "severity": "warning", "badge": "low battery",
         "drone_id": 1 + n % DRONES, "words": "w" * 500, "opened_at": _ago(n), "closed_at": _ago(n)}
        for n in range(20_000)
    )  # fmt: skip
    yield AlertChannelRow, (
        {"user_id": 2, "kind": "mail", "target": f"{n}@example.org", "severity": "warning", "drones": "all",
         "created_at": _NOW} for n in range(5)
    )  # fmt: skip
    said = {"words": "w" * 500, "drone": {"id": 1, "name": _LONG_NAME}}
    yield AlertDeliveryRow, (
        {"channel_id": 1, "alert_id": 1 + n, "happening": "opened", "content": said, "created_at": _ago(n),
         "due_at": _ago(n), "ended_at": _ago(n), "problem": "p" * 200} for n in range(10_000)
    )  # fmt: skip
    yield RecordingRow, (
        {"drone_id": 1, "store": "none", "file": f"{n:032}", "by_name": _LONG_NAME, "quality": "medium",
         "codec": "h264", "state": "ready", "began_at": _ago(n), "ended_at": _ago(n),
         "flights": [_NOW.isoformat()] * 5} for n in range(2_000)
    )  # fmt: skip
    yield MaintenanceTaskRow, (
        {"drone_id": 1 + n % DRONES, "title": "t" * 80, "interval_h": 50.0, "done_at": _NOW, "done_by": _LONG_NAME}
        for n in range(40 * DRONES)
    )  # fmt: skip
    yield SessionRow, (
        {"token_hash": f"{n:064}", "user_id": 1 + n % USERS, "created_at": _NOW, "last_seen_at": _NOW,
         "address": "192.0.2.1", "user_agent": "u" * 250} for n in range(2_000)
    )  # fmt: skip
    yield ApiTokenRow, (
        {"token_hash": f"{n:064}", "user_id": 1 + n % USERS, "name": _LONG_NAME, "scopes": "fly watch",
         "created_at": _NOW, "expires_at": _NOW + timedelta(days=30)} for n in range(49 * USERS)
    )  # fmt: skip
