"""Who may call a route: one dependency per kind of person. Each yields the principal of the request.

`server.kernel.access` decides for REST, WebSocket, UDP and video alike, and lists the scopes that each action needs.

A drone that does not exist and a drone of somebody else get the same answer: `judge` receives the user's relation to
the drone (`server.kernel.relations` lists what each relation allows), or None when there is no such drone, and refuses
both in the same words.
"""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import Depends
from starlette.requests import HTTPConnection

from server.http.dependencies import AuthenticatorDep
from server.kernel.access import Action
from server.kernel.people import Principal


def who_may(action: Action) -> Any:
    """Dependency of a route: yields the principal of the request, or raises the refusal."""

    async def checked(connection: HTTPConnection, authenticator: AuthenticatorDep) -> Principal:
        return await authenticator.admit(connection, action)

    checked.action = action  # type: ignore[attr-defined]  # for the test that walks all routes
    return Depends(checked)


Anybody = Annotated[Principal, who_may(Action.KNOW_ONESELF)]
"""Any signed-in user or token."""
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
"""Any user signed in with a session."""
Prover = Annotated[Principal, who_may(Action.PROVE_ONESELF)]
"""Any user with a session, even before the first password is changed or a demanded second factor is set up."""
Proved = Annotated[Principal, who_may(Action.CHANGE_CREDENTIALS)]
"""A user with a session and a fresh proof of identity."""
FactorSetter = Annotated[Principal, who_may(Action.SET_UP_SECOND_FACTOR)]
PasswordChanger = Annotated[Principal, who_may(Action.CHANGE_PASSWORD)]
ProvedAdmin = Annotated[Principal, who_may(Action.CHANGE_USERS)]
"""An admin with a session and a fresh proof of identity."""
DroneKeyAdmin = Annotated[Principal, who_may(Action.CHANGE_DRONE_KEYS)]
"""The same, for keys of drones."""
