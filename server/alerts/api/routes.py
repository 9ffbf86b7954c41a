"""`/api/v1/alerts`: what is or was wrong with the drones of the squad, and who has seen to it."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from fastapi import APIRouter, Path, Query, Response
from pydantic import AwareDatetime

from server.alerts.core.refusals import MayNotAcknowledge, UnknownAlert
from server.alerts.core.rules import BY_NAME, RANK
from server.alerts.core.service import knows_of_tower
from server.alerts.core.severity import Severity
from server.alerts.core.views import ALL_RULES, AlertRuleView, AlertView
from server.alerts.store.history import AlertFilter, list_alerts
from server.alerts.store.tables import AlertRow
from server.alerts.store.writer import Acknowledgement
from server.audit.store.trail import Actor
from server.fleet.core.views import UserRefView
from server.http.access import Pilot, Viewer
from server.http.dependencies import AddressDep, AlertWriterDep, DatabaseDep, HubDep
from server.http.long_list import long_list
from server.http.problem_docs import answers
from server.kernel.access import NotSignedIn, SessionExpired
from server.runtime.request_id import current_request_id
from wire.ids import DroneId

router = APIRouter(prefix="/api/v1/alerts", tags=["alerts"], responses=answers(NotSignedIn, SessionExpired))

MAX_ID: Final = 2**53 - 1
AlertPath = Annotated[int, Path(ge=0, le=MAX_ID)]


@router.get("", response_model=list[AlertView])
async def get_alerts(
    principal: Viewer,
    hub: HubDep,
    database: DatabaseDep,
    writer: AlertWriterDep,
    state: Annotated[Literal["open", "closed"] | None, Query(description="Whether it lasts")] = None,
    acknowledged: Annotated[bool | None, Query(description="Whether somebody has seen to it")] = None,
    severity: Annotated[Severity | None, Query()] = None,
    rule: Annotated[str | None, Query(max_length=40, pattern="^[a-z-]+$", description="The name of a rule")] = None,
    drone_id: Annotated[int | None, Query(ge=1, le=2**31 - 1)] = None,
    since: Annotated[AwareDatetime | None, Query(description="Opened not before")] = None,
    until: Annotated[AwareDatetime | None, Query(description="Opened before")] = None,
    before: Annotated[int | None, Query(ge=0, le=MAX_ID, description="Only alerts after this one in the list")] = None,
    limit: Annotated[int, Query(ge=1, le=500)] = 100,
) -> Response:
    """Lists the alerts of your squad, the newest first; admins also get those of the tower itself. For the next page,
    set `before` to the last id. An alert must match all given parameters."""
    squad = frozenset(int(drone.drone_id) for drone in hub.squads.drones(principal.user_id, principal.role))
    wanted = AlertFilter(
        drone_ids=squad if drone_id is None else squad & {drone_id},
        of_tower=drone_id is None and knows_of_tower(principal),
        is_open=None if state is None else state == "open",
        is_acknowledged=acknowledged,
        severity=severity,
        rule=rule,
        since=since,
        until=until,
    )

    def may_know(row: AlertRow) -> bool:
        other = None if row.other_id is None else DroneId(row.other_id)
        about = None if row.drone_id is None else DroneId(row.drone_id)
        return hub.alerts.may_know(principal, about, other, about_stranger=row.about_stranger, at=row.opened_at)

    in_memory = [*hub.alerts.live(), *writer.waiting()]
    rows = await list_alerts(database, wanted, in_memory=in_memory, may_know=may_know, before=before, limit=limit)
    return await long_list(map(_view, rows))


@router.get("/rules")
async def get_alert_rules(principal: Viewer) -> list[AlertRuleView]:
    """Returns the table of rules, the most urgent first."""
    return ALL_RULES


@router.post("/{alert_id}/acknowledge", responses=answers(UnknownAlert, MayNotAcknowledge))
async def acknowledge_alert(
    principal: Pilot, hub: HubDep, writer: AlertWriterDep, address: AddressDep, alert_id: AlertPath
) -> AlertView:
    """Acknowledges an alert that is open, or is over and was critical: a pilot of the drone has seen to it. Everybody
    who sees the drone learns of it. Repeated, it changes nothing."""
    before = hub.alerts.acknowledgement_of(alert_id)
    alert = hub.alerts.acknowledge(alert_id, principal)
    if before is None:
        by = Acknowledgement(Actor(principal.user_id, principal.name), address, current_request_id())
        writer.acknowledged(alert, by)
    return AlertView.of(alert)


def _view(row: AlertRow) -> AlertView:
    """A stored alert. Its rule may be of another version."""
    rule = BY_NAME.get(row.rule)
    by = row.acknowledged_by_id
    return AlertView(
        id=row.id,
        rule=row.rule,
        severity=Severity(row.severity),
        badge=row.badge,
        words=row.words,
        advice=rule.advice if rule is not None else "",
        rank=RANK.get(row.rule, len(RANK)),
        drone_id=row.drone_id,
        other_id=None if row.about_stranger else row.other_id,
        opened_at=row.opened_at,
        acknowledged_at=row.acknowledged_at,
        acknowledged_by=None if by is None else UserRefView(id=by, name=row.acknowledged_by_name),
        closed_at=row.closed_at,
        closed_why=row.closed_why,
    )
