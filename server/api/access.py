"""Who may call a route: one dependency per kind of person, each of which yields the principal of the request.

`server.domain.access` has the one judgement for REST, WebSocket, UDP and video, and the scopes that an action requires.

"Not yours" and "not there" get the same response: `judge` gets the user's relation to a drone
(`server.domain.relations`), or None if there is no such drone, and refuses both with the same words.
"""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import Depends
from starlette.requests import HTTPConnection

from server.api.dependencies import AuthenticatorDep
from server.domain.access import Action
from server.domain.people import Principal


def who_may(action: Action) -> Any:
    """A route's dependency: the principal of the request, if it may do that."""

    async def checked(connection: HTTPConnection, authenticator: AuthenticatorDep) -> Principal:
        return await authenticator.admit(connection, action)

    checked.action = action  # type: ignore[attr-defined]  # for the test that walks all routes
    return Depends(checked)


Anybody = Annotated[Principal, who_may(Action.KNOW_ONESELF)]
"""Whoever is signed in, however."""
Viewer = Annotated[Principal, who_may(Action.SEE_SQUAD)]
Pilot = Annotated[Principal, who_may(Action.FLY)]
Commander = Annotated[Principal, who_may(Action.COMMAND)]
Admin = Annotated[Principal, who_may(Action.ADMINISTER)]
TeamMember = Annotated[Principal, who_may(Action.MANAGE_TEAMS)]
TeamEditor = Annotated[Principal, who_may(Action.LEAD_TEAMS)]
MissionWriter = Annotated[Principal, who_may(Action.CHANGE_MISSIONS)]
MetricsReader = Annotated[Principal, who_may(Action.READ_METRICS)]
InPerson = Annotated[Principal, who_may(Action.SEE_CREDENTIALS)]
Oneself = Annotated[Principal, who_may(Action.CHANGE_PREFERENCES)]
"""Whoever is signed in, in person."""
Prover = Annotated[Principal, who_may(Action.PROVE_ONESELF)]
"""A user who may prove their identity: in person, before anything else that an account requires."""
Proved = Annotated[Principal, who_may(Action.CHANGE_CREDENTIALS)]
"""Whoever is signed in, in person, and proved who they are a moment ago."""
FactorSetter = Annotated[Principal, who_may(Action.SET_UP_SECOND_FACTOR)]
PasswordChanger = Annotated[Principal, who_may(Action.CHANGE_PASSWORD)]
ProvedAdmin = Annotated[Principal, who_may(Action.CHANGE_USERS)]
"""An admin in person, who proved who they are a moment ago."""
