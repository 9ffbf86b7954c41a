"""`/api/v1/me/alert-channels/browsers`: browsers that show alerts by web push. Listed, tried, changed and deleted like
other channels (`channel_routes.py`)."""

from __future__ import annotations

from typing import Annotated, cast

from fastapi import APIRouter
from pydantic import BaseModel, ConfigDict, Field

from server.alerts.api.channel_routes import AlertChannelView, ChannelPath, Drones, Least
from server.alerts.core.severity import Severity
from server.alerts.store.channels import browsers
from server.alerts.store.channels.refusals import BadAlertChannel, TooManyBrowsers, UnknownAlertChannel
from server.http.access import InPerson, Oneself, Proved
from server.http.dependencies import AlertDelivererDep, AuditDep, DatabaseDep, SettingsDep, VaultDep
from server.http.problem_docs import answers
from server.kernel.access import InPersonOnly, NotSignedIn, SessionExpired

router = APIRouter(
    prefix="/api/v1/me/alert-channels/browsers",
    tags=["alerts"],
    responses=answers(NotSignedIn, SessionExpired, InPersonOnly),
)


class PushKeyView(BaseModel):
    public_key: Annotated[str, Field(description="Of the tower (VAPID): a point of P-256 as base64url")]


class NewPushChannel(BaseModel):
    """What `PushSubscription.toJSON()` says, and which alerts to send there."""

    model_config = ConfigDict(extra="forbid")

    endpoint: Annotated[str, Field(min_length=1, max_length=1000)]
    p256dh: Annotated[str, Field(min_length=1, max_length=100, description="base64url")]
    auth: Annotated[str, Field(min_length=1, max_length=40, description="base64url")]
    browser: Annotated[str, Field(max_length=60, description="A name for the list")] = ""
    severity: Least = Severity.WARNING
    drones: Drones = "all"


@router.get("/key")
async def get_push_key(principal: InPerson, deliverer: AlertDelivererDep) -> PushKeyView:
    """Returns the key to subscribe with: `applicationServerKey`."""
    return PushKeyView(public_key=deliverer.push_key.vapid.public_key)


@router.post("", status_code=201, responses=answers(TooManyBrowsers, BadAlertChannel))
async def add_push_channel(
    principal: Proved,
    database: DatabaseDep,
    audit: AuditDep,
    settings: SettingsDep,
    vault: VaultDep,
    body: NewPushChannel,
) -> AlertChannelView:
    """Adds the browser that you are signed in with. It belongs to whoever subscribed in it last. Signing out there ends
    it."""
    subscription = browsers.read_subscription(
        body.endpoint, body.p256dh, body.auth, body.browser, may_be_private=settings.webhooks_may_be_private
    )
    async with database.writing() as session:
        row = await browsers.add_browser(
            session,
            subscription,
            user_id=principal.user_id,
            session_id=cast("int", principal.session_id),  # nobody proves their identity with a token
            severity=body.severity,
            drones=body.drones,
            vault=vault,
            action=audit.action(principal),
        )
    return AlertChannelView.of(row)


@router.post("/{channel_id}/keep", responses=answers(UnknownAlertChannel))
async def keep_push_channel(principal: Oneself, database: DatabaseDep, channel_id: ChannelPath) -> AlertChannelView:
    """Says that this browser is here with your present session, whose sign-out ends the channel from now on."""
    async with database.writing() as session:
        row = await browsers.keep_browser(
            session, channel_id, user_id=principal.user_id, session_id=cast("int", principal.session_id)
        )
    return AlertChannelView.of(row)
