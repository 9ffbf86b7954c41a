"""`/api/v1/tokens`: API tokens. Users make their own; admins see and revoke all."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Annotated

from fastapi import APIRouter, Path, Query, Response
from pydantic import AwareDatetime, BaseModel, ConfigDict, Field

from server.accounts.store import tokens
from server.accounts.store.tables import ApiTokenRow, UserRow
from server.accounts.store.tokens import TooManyTokens, UnknownToken, scopes_of
from server.accounts.store.users import get_user
from server.http.access import InPerson, Proved
from server.http.dependencies import (
    ApiTokensDep,
    AuditDep,
    DatabaseDep,
    EventHandlerDep,
    HubDep,
    RosterDep,
    SettingsDep,
)
from server.http.long_list import long_list
from server.http.problem_docs import answers
from server.kernel.access import (
    AccessRequest,
    Action,
    AdminsOnly,
    InPersonOnly,
    NotSignedIn,
    SessionExpired,
    judge,
    reaches_all,
)
from server.kernel.people import TokenId
from server.kernel.scopes import Scope

router = APIRouter(
    prefix="/api/v1/tokens", tags=["tokens"], responses=answers(NotSignedIn, SessionExpired, InPersonOnly)
)


class TokenOwner(BaseModel):
    id: int
    name: str


class TokenView(BaseModel):
    """A token, without its secret."""

    id: int
    name: str
    owner: TokenOwner
    scopes: list[Scope]
    created_at: datetime
    expires_at: datetime
    last_used_at: Annotated[datetime | None, Field(description="null: never used")]
    last_used_address: Annotated[str, Field(description="Address of the last connection with it; may be empty")]

    @classmethod
    def of(cls, row: ApiTokenRow, owner: UserRow) -> TokenView:
        return cls(
            id=row.id,
            name=row.name,
            owner=TokenOwner(id=owner.id, name=owner.name),
            scopes=sorted(scopes_of(row)),
            created_at=row.created_at,
            expires_at=row.expires_at,
            last_used_at=row.last_used_at,
            last_used_address=row.last_used_address,
        )


class NewToken(BaseModel):
    """The purpose of the new token. A token never allows more than its owner may do."""

    model_config = ConfigDict(extra="forbid")

    name: Annotated[str, Field(description="Purpose, in 1 to 64 printable characters")]
    scopes: Annotated[list[Scope], Field(max_length=16)]
    expires_at: Annotated[
        AwareDatetime | None, Field(description="null: in 90 days, or the tower's maximum if that is earlier")
    ] = None


class TokenWithSecret(BaseModel):
    """The only response that ever contains the token."""

    token: TokenView
    secret: Annotated[str, Field(description="For `Authorization: Bearer`. The tower keeps only its hash")]


@router.get("", response_model=list[TokenView], responses=answers(AdminsOnly))
async def list_tokens(
    principal: InPerson,
    api_tokens: ApiTokensDep,
    database: DatabaseDep,
    everybody: Annotated[bool, Query(description="Admins: of all users")] = False,
) -> Response:
    """Lists your tokens, or those of all users, by id."""
    verdict = judge(AccessRequest(principal, Action.SEE_CREDENTIALS, everybody=everybody))
    if verdict.refusal is not None:
        raise verdict.refusal
    await api_tokens.write_uses()
    async with database.reading() as session:
        listed = tokens.list_tokens(session, user_id=None if everybody else principal.user_id)
        return await long_list(TokenView.of(row, owner) async for row, owner in listed)


@router.post("", status_code=201, responses=answers(TooManyTokens))
async def create_token(
    principal: Proved, database: DatabaseDep, audit: AuditDep, settings: SettingsDep, roster: RosterDep, body: NewToken
) -> TokenWithSecret:
    """Creates a token for yourself and shows it once."""
    async with database.writing() as session:
        owner = await get_user(session, principal.user_id)
        row, secret = await tokens.create_token(
            session,
            owner=owner,
            name=body.name,
            scopes=body.scopes,
            expires_at=body.expires_at,
            action=audit.action(principal),
            longest=timedelta(days=settings.token_longest_days),
        )
    await roster.refresh()
    return TokenWithSecret(token=TokenView.of(row, owner), secret=secret)


@router.delete("/{token_id}", status_code=204, responses=answers(UnknownToken))
async def revoke_token(
    principal: Proved,
    database: DatabaseDep,
    audit: AuditDep,
    hub: HubDep,
    roster: RosterDep,
    event_handler: EventHandlerDep,
    token_id: Annotated[int, Path(ge=1, le=2**31 - 1)],
) -> None:
    """Revokes one of your tokens; an admin can revoke any. Connections that use it close at once."""
    of_user = None if reaches_all(principal.role, Action.CHANGE_CREDENTIALS) else principal.user_id
    async with database.writing() as session:
        await tokens.revoke_token(session, token_id=token_id, of_user=of_user, action=audit.action(principal))
    hub.end_sessions([TokenId(token_id)])
    await roster.refresh()
    await event_handler.caught_up()  # drones flown with this token hold before the response
