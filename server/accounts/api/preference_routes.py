"""`/api/v1/me/preferences`: documents that the console stores for the signed-in user."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Body, Path

from server.accounts.store.preferences import (
    PreferenceTooLarge,
    TooManyPreferences,
    keep_preference,
    preferences_of,
)
from server.http.access import Anybody, Oneself
from server.http.dependencies import ClockDep, DatabaseDep
from server.http.problem_docs import answers
from server.kernel.access import BadToken, InPersonOnly, NotSignedIn, SessionExpired

router = APIRouter(
    prefix="/api/v1/me/preferences", tags=["session"], responses=answers(NotSignedIn, SessionExpired, BadToken)
)

Name = Annotated[str, Path(pattern="^[a-z][a-z0-9-]{0,31}$", description="the document's subject, such as `sticks`")]
Document = Annotated[dict[str, Any], Body(description="any JSON object of at most 8 KiB")]


@router.get("")
async def get_preferences(principal: Anybody, database: DatabaseDep) -> dict[str, dict[str, Any]]:
    """Returns every document by name; an empty object if there are none."""
    async with database.reading() as session:
        return await preferences_of(session, principal.user_id)


@router.put("/{name}", status_code=204, responses=answers(InPersonOnly, PreferenceTooLarge, TooManyPreferences))
async def put_preference(
    principal: Oneself, database: DatabaseDep, clock: ClockDep, name: Name, document: Document
) -> None:
    """Stores a document and replaces the one of the same name. An empty object deletes it.

    Not allowed with a token: these documents define how a pilot's sticks are read, which is no business of a program.
    """
    async with database.writing() as session:
        await keep_preference(session, user_id=principal.user_id, name=name, document=document, now=clock())
