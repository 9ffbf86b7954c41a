"""`/api/v1/me/alert-channels`: where a user is told of alerts outside of the console."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from fastapi import APIRouter, Path
from pydantic import BaseModel, ConfigDict, Field

from server.alerts.core.severity import Severity
from server.alerts.io.message import Message, SubscriptionGone
from server.alerts.store.channels import channels
from server.alerts.store.channels.channels import ChannelWish
from server.alerts.store.channels.deliverer import AlertDeliverer
from server.alerts.store.channels.outbox import rows_waiting
from server.alerts.store.channels.refusals import (
    BadAlertChannel,
    TooManyAlertChannels,
    TooManyMessages,
    UnknownAlertChannel,
)
from server.alerts.store.channels.tables import AlertChannelRow
from server.http.access import InPerson, Oneself, Proved
from server.http.dependencies import AlertDelivererDep, AuditDep, DatabaseDep, SettingsDep, VaultDep
from server.http.problem_docs import answers
from server.kernel.access import InPersonOnly, NotSignedIn, SessionExpired
from server.kernel.clock import utc_now
from server.runtime.settings import Settings

router = APIRouter(
    prefix="/api/v1/me/alert-channels", tags=["alerts"], responses=answers(NotSignedIn, SessionExpired, InPersonOnly)
)
ChannelPath = Annotated[int, Path(ge=1, le=2**31 - 1)]
Kind = Literal["mail", "webhook"]
Drones = Annotated[Literal["all", "own"], Field(description="All drones that you may see, or only those you own")]
Least = Annotated[Severity, Field(description="The least severe alerts that it gets")]


class AlertChannelView(BaseModel):
    id: int
    kind: Literal["mail", "webhook", "push"]
    target: Annotated[
        str, Field(description="An e-mail address, the address of a webhook, or the endpoint of a browser")
    ]
    browser: Annotated[str, Field(description="Name of a browser; else empty")]
    severity: Least
    drones: Drones
    is_confirmed: Annotated[bool, Field(description="false: a mail address whose code was not entered yet")]
    created_at: datetime
    sent_at: Annotated[datetime | None, Field(description="The last success")]
    problem: Annotated[str, Field(description="Of the last attempt; empty if it succeeded")]
    waiting: Annotated[int, Field(description="Deliveries on their way")]

    @classmethod
    def of(cls, row: AlertChannelRow, waiting: int = 0) -> AlertChannelView:
        return cls.model_validate(
            {
                "id": row.id,
                "kind": row.kind,
                "target": row.target,
                "browser": row.browser,
                "severity": row.severity,
                "drones": row.drones,
                "is_confirmed": row.code_hash is None,
                "created_at": row.created_at,
                "sent_at": row.sent_at,
                "problem": row.problem,
                "waiting": waiting,
            }
        )


class NewAlertChannel(BaseModel):
    model_config = ConfigDict(extra="forbid")

    kind: Kind
    target: Annotated[str, Field(min_length=1, max_length=1000)]
    severity: Least = Severity.WARNING
    drones: Drones = "all"


class MadeAlertChannel(BaseModel):
    channel: AlertChannelView
    secret: Annotated[str, Field(description="Of a webhook: the key of its signatures, shown once. Else empty")]
    problem: Annotated[str, Field(description="Why no mail with a code was sent; else empty")]


class AlertChannelChange(BaseModel):
    model_config = ConfigDict(extra="forbid")

    severity: Least | None = None
    drones: Drones | None = None


class AlertChannelCode(BaseModel):
    model_config = ConfigDict(extra="forbid")

    code: Annotated[str, Field(min_length=1, max_length=32)]


class AlertChannelTest(BaseModel):
    is_sent: bool
    problem: Annotated[str, Field(description="Why not; empty if it was sent")]


@router.get("")
async def list_alert_channels(principal: InPerson, database: DatabaseDep) -> list[AlertChannelView]:
    """Lists your alert channels, oldest first."""
    async with database.reading() as session:
        rows = await channels.list_channels(session, principal.user_id)
        waiting = dict((await session.execute(rows_waiting([row.id for row in rows]))).all())
    return [AlertChannelView.of(row, waiting.get(row.id, 0)) for row in rows]


@router.post("", status_code=201, responses=answers(TooManyAlertChannels, BadAlertChannel, TooManyMessages))
async def add_alert_channel(
    principal: Proved,
    database: DatabaseDep,
    audit: AuditDep,
    settings: SettingsDep,
    vault: VaultDep,
    deliverer: AlertDelivererDep,
    body: NewAlertChannel,
) -> MadeAlertChannel:
    """Adds a channel. A mail address gets a code, and no alerts before you enter it
    (`/me/alert-channels/{channel_id}/confirm`). A webhook is called with a signature (docs/alerts.md)."""
    wish = ChannelWish(body.kind, body.target, body.severity, body.drones)
    _check(wish, settings)
    if wish.kind == "mail":
        deliverer.admit(principal.user_id)
    async with database.writing() as session:
        row, secret = await channels.add_channel(
            session, wish, user_id=principal.user_id, vault=vault, action=audit.action(principal)
        )
    if wish.kind == "webhook":
        return MadeAlertChannel(channel=AlertChannelView.of(row), secret=secret, problem="")
    problem = await _send_code(deliverer, row, secret, principal.name)
    return MadeAlertChannel(channel=AlertChannelView.of(row), secret="", problem=problem)


@router.post("/{channel_id}/confirm", responses=answers(UnknownAlertChannel, BadAlertChannel))
async def confirm_alert_channel(
    principal: Oneself, database: DatabaseDep, channel_id: ChannelPath, body: AlertChannelCode
) -> AlertChannelView:
    """Enters the code from the mail."""
    async with database.writing() as session:
        is_right = await channels.confirm_channel(session, channel_id, body.code, user_id=principal.user_id)
        row = await channels.get_channel(session, channel_id, principal.user_id)
    if not is_right:
        raise BadAlertChannel("the code is wrong")
    return AlertChannelView.of(row)


@router.patch("/{channel_id}", responses=answers(UnknownAlertChannel))
async def change_alert_channel(
    principal: Oneself, database: DatabaseDep, audit: AuditDep, channel_id: ChannelPath, body: AlertChannelChange
) -> AlertChannelView:
    """Changes which alerts a channel gets."""
    async with database.writing() as session:
        row = await channels.change_channel(
            session,
            channel_id,
            user_id=principal.user_id,
            severity=body.severity,
            drones=body.drones,
            action=audit.action(principal),
        )
    return AlertChannelView.of(row)


@router.delete("/{channel_id}", status_code=204, responses=answers(UnknownAlertChannel))
async def delete_alert_channel(
    principal: Oneself, database: DatabaseDep, audit: AuditDep, channel_id: ChannelPath
) -> None:
    """Deletes a channel, and what is on its way there."""
    async with database.writing() as session:
        await channels.delete_channel(session, channel_id, user_id=principal.user_id, action=audit.action(principal))


@router.post("/{channel_id}/test", responses=answers(UnknownAlertChannel, BadAlertChannel, TooManyMessages))
async def try_alert_channel(
    principal: Oneself, database: DatabaseDep, deliverer: AlertDelivererDep, channel_id: ChannelPath
) -> AlertChannelTest:
    """Sends a test now, once."""
    async with database.reading() as session:
        row = await channels.get_channel(session, channel_id, principal.user_id)
    if row.code_hash is not None:
        raise BadAlertChannel("enter the code from the mail first")
    deliverer.admit(principal.user_id)
    text = f"This is a test for {principal.name}. Alerts of your drones arrive here.\n"
    content = {"type": "test", "words": text.strip()}
    message = Message(f"test-{row.id}-{deliverer.next_number()}", "A test of your alerts", text, content)
    try:
        problem = await deliverer.send_now(row.kind, row.target, row.secret_sealed, row.user_id, message)
    except SubscriptionGone as gone:
        await deliverer.end_gone(row.id)
        return AlertChannelTest(is_sent=False, problem=f"{gone}: the channel is deleted")
    async with database.writing() as session:
        await channels.note_attempt(session, row.id, problem, utc_now())
    return AlertChannelTest(is_sent=not problem, problem=problem)


def _check(wish: ChannelWish, settings: Settings) -> None:
    channels.check_target(wish, may_be_private=settings.webhooks_may_be_private)
    if wish.kind == "mail" and not settings.mail_server.host:
        raise BadAlertChannel("this tower sends no mail: its admin has not set TOWER_MAIL_SERVER")


async def _send_code(deliverer: AlertDeliverer, row: AlertChannelRow, code: str, name: str) -> str:
    text = (
        f"{name} wants alerts of drones to be sent to this address. The code is\n\n    {code}\n\n"
        "Enter it in the console, under Account. If this is not you, delete this mail: nothing more comes.\n"
    )
    message = Message(f"code-{row.id}", "A code for alerts of drones", text, {})
    return await deliverer.send_now(row.kind, row.target, None, row.user_id, message)
