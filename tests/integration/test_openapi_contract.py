"""Tests the tower against its own OpenAPI schema: every operation, as every role, with allowed and forbidden input.

An operation that the access table denies to a role succeeds with no request at all.

Schemathesis makes the requests from `/api/v1/openapi.json` and checks the responses. There is no catch-all: each
operation declares each of its statuses, and each body fits its schema. Derandomized: the same requests in each run.
"""

import asyncio
import importlib
import pkgutil
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import pytest
import schemathesis
import schemathesis.specs.openapi
from fastapi.routing import APIRoute
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis.errors import Unsatisfiable
from schemathesis import Case, GenerationMode
from schemathesis.checks import not_a_server_error
from schemathesis.core.failures import FailureGroup
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    negative_data_rejection,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
    unsupported_method,
)
from test_server_access_table import TABLE as ACCESS
from test_server_access_table import TOKENS as ACCESS_TOKENS
from test_server_access_table import VISITORS as ACCESS_VISITORS
from tower_world import PASSWORD, TowerWorld, start_tower
from worlds.tiers import examples, is_long

from server.accounts.store.tables import UserRow
from server.accounts.store.tokens import create_token
from server.airspace.store.zones import create_zone
from server.alerts.core.severity import Severity
from server.alerts.store.channels.channels import ChannelWish, add_channel
from server.app.routers import ROUTERS
from server.audit.store.action import AuditAction
from server.audit.store.trail import COMMAND_LINE
from server.http.authentication import COOKIE
from server.kernel.people import Role
from server.kernel.scopes import Scope
from server.kernel.shares import Shares
from server.teams.store.teams import COMMAND_LINE as TEAMS_OF_COMMAND_LINE
from wire.zones.kinds import ZoneKind, ZoneRule
from wire.zones.zone import Zone, ZoneShape

# Imports everything now, before there are threads: pytest reads the source of its plugins, and Python 3.11 cannot parse
# in two threads at once ("AST constructor recursion depth mismatch").
for found in pkgutil.walk_packages(schemathesis.specs.openapi.__path__, "schemathesis.specs.openapi."):
    importlib.import_module(found.name)

# A map file and a picture of heights are bytes like any other.
schemathesis.serializer.alias("application/vnd.pmtiles", "application/octet-stream")
schemathesis.serializer.alias("image/tiff", "application/octet-stream")

CHECKS: Final = [
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
    unsupported_method,
]
EXAMPLES: Final = examples(1, long=6)
"""For each operation, each kind and each visitor."""
VISITORS: Final = {
    "anonymous": "anonymous",
    "operator": "owner",
    "admin": "admin",
    "a token for watch": "for watch",
    "a token for metrics": "for metrics",
}
"""The visitor's column of the access table."""
OF_TOKENS: Final = {"a token for watch": Scope.WATCH, "a token for metrics": Scope.METRICS}
"""An admin's tokens of one scope each. They send the first example of each kind; in the short tier, of good ones."""
MAY: Final = "+?"
NAMES: Final = {
    route.operation_id or route.name: route.name
    for router in ROUTERS
    for route in router.routes
    if isinstance(route, APIRoute) and route.include_in_schema
}
"""Maps the schema's operations to their names in the access table."""
ANSWER_WITHIN_S: Final = 60.0
"""For a busy machine."""


@dataclass
class Scene:
    """Fresh after each operation that changes something: some end sessions, delete users and remove drones."""

    cookies: dict[str, dict[str, str]]
    headers: dict[str, dict[str, str]]
    ids: dict[str, int]


@dataclass
class Walk:
    """Sends every operation of the schema, in a thread beside the tower's event loop."""

    world: TowerWorld
    loop: asyncio.AbstractEventLoop
    wrong: list[str] = field(default_factory=list)
    walked: set[str] = field(default_factory=set)
    statuses: dict[str, set[int]] = field(default_factory=dict)
    let_in: dict[str, set[str]] = field(default_factory=dict)
    """Operations that succeeded, by visitor."""

    def all_operations(self) -> None:
        schema = schemathesis.openapi.from_url(f"{self.world.base_url}/api/v1/openapi.json", timeout=ANSWER_WITHIN_S)
        # One hash for all: two for each operation would be most of the walk's cost.
        hashing = self.world.tower.passwords.hash(PASSWORD)
        password_hash = asyncio.run_coroutine_threadsafe(hashing, self.loop).result(ANSWER_WITHIN_S)
        scene: Scene | None = None
        for number, found in enumerate(schema.get_all_operations()):
            operation = found.ok()
            name = str(operation.definition.raw["operationId"])
            self.walked.add(name)
            if scene is None:
                making = set_the_scene(self.world, number, password_hash)
                scene = asyncio.run_coroutine_threadsafe(making, self.loop).result(ANSWER_WITHIN_S)
            for mode in (GenerationMode.POSITIVE, GenerationMode.NEGATIVE):
                # An operation without possible faults has no bad requests.
                with suppress(Unsatisfiable):
                    self._send(name, operation.as_strategy(generation_mode=mode), scene, mode)
            if operation.method.upper() != "GET":
                scene = None

    def _send(self, name: str, strategy: Any, scene: Scene, mode: GenerationMode) -> None:
        checks = [*CHECKS, negative_data_rejection] if mode is GenerationMode.NEGATIVE else CHECKS
        asked = 0

        @settings(
            max_examples=EXAMPLES,
            derandomize=True,
            database=None,
            deadline=None,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        @given(case=strategy)
        def ask(case: Case) -> None:
            nonlocal asked
            if asked % 2 == 0 and mode is GenerationMode.POSITIVE:
                # Prefers existing ids; otherwise nearly every path would end with "there is no such drone".
                known = scene.ids.items() & {(key, scene.ids.get(key)) for key in case.path_parameters or {}}
                case.path_parameters.update(known)
            for visitor in VISITORS:
                if visitor not in OF_TOKENS or (asked == 0 and (is_long() or mode is GenerationMode.POSITIVE)):
                    self._one(name, visitor, case, scene, checks)
            asked += 1

        ask()

    def _one(self, name: str, visitor: str, case: Case, scene: Scene, checks: list[Any]) -> None:
        answer = case.call(
            base_url=self.world.base_url,
            cookies=scene.cookies[visitor],
            headers=scene.headers[visitor],
            timeout=ANSWER_WITHIN_S,
        )
        self.statuses.setdefault(name, set()).add(answer.status_code)
        if answer.status_code < 300:
            self.let_in.setdefault(visitor, set()).add(name)
            if may(name, visitor) not in MAY:
                self.wrong.append(f"{name} as {visitor}: {answer.status_code}, and the access table says no")
        # Authentication precedes validation of the request.
        refused = answer.status_code in (401, 403)
        try:
            case.validate_response(
                answer, checks=[one for one in checks if not (refused and one is negative_data_rejection)]
            )
        except (FailureGroup, AssertionError) as failure:
            reported = [str(one) for one in getattr(failure, "exceptions", [failure])]
            self.wrong += [f"{name} as {visitor} ({answer.status_code}): {one[:400]}" for one in reported]


def may(operation: str, visitor: str) -> str:
    """Returns the sign from the access table."""
    columns = (*ACCESS_VISITORS, *ACCESS_TOKENS)
    return ACCESS[NAMES[operation]].split()[columns.index(VISITORS[visitor])]


async def set_the_scene(world: TowerWorld, number: int, password_hash: str) -> Scene:
    """Makes an operator with a drone, an admin, and one of everything that has an id."""
    now = world.clock()

    async def the_same(_: str) -> str:
        return password_hash

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(world.tower.passwords, "hash", the_same)
        people = {
            "operator": await world.add_user(f"operator {number}"),
            "admin": await world.add_user(f"admin {number}", Role.ADMIN),
        }
    drone = await world.add_drone(f"drone {number}", people["operator"])
    cookies: dict[str, dict[str, str]] = {visitor: {} for visitor in VISITORS}
    headers: dict[str, dict[str, str]] = {visitor: {} for visitor in VISITORS}
    async with world.database.writing() as session:
        for visitor, person in people.items():
            begun = await world.tower.sessions.begin(session, user_id=person.id, now=now, address="", user_agent="")
            cookies[visitor] = {COOKIE: begun.token}
        spare = await world.tower.sessions.begin(
            session, user_id=people["operator"].id, now=now, address="", user_agent=""
        )
        owner = await session.get(UserRow, people["admin"].id)
        assert owner is not None
        for visitor, scope in OF_TOKENS.items():
            action = AuditAction(by=COMMAND_LINE, at=now)
            _, secret = await create_token(
                session, owner=owner, name=visitor, scopes={scope}, expires_at=None, action=action
            )
            headers[visitor] = {"Authorization": f"Bearer {secret}"}
        place = ZoneShape(points=((1.0, 1.0), (1.0, 1.001), (1.001, 1.0)))
        zone = await create_zone(
            session,
            Zone(id=0, name=f"zone {number}", kind=ZoneKind.NO_FLY, rule=ZoneRule.WARN, shape=place),
            manager=TEAMS_OF_COMMAND_LINE,
            action=AuditAction(by=COMMAND_LINE, at=now),
            shares=Shares(),
        )
        hook = ChannelWish("webhook", "https://localhost/", Severity.WARNING, "all")
        channel, _ = await add_channel(
            session,
            hook,
            user_id=people["operator"].id,
            vault=world.tower.vault,
            action=AuditAction(by=COMMAND_LINE, at=now),
        )
    ids = {
        "drone_id": drone.id,
        "user_id": people["operator"].id,
        "session_id": spare.session_id,
        "zone_id": zone.id,
        "channel_id": channel.id,
    }
    return Scene(cookies, headers, ids)


@pytest.fixture
async def walk(tmp_path: Path) -> Any:
    async with start_tower(tmp_path) as world:
        yield Walk(world, asyncio.get_running_loop())


async def test_every_operation_keeps_to_the_schema_whoever_asks(walk: Walk) -> None:
    await asyncio.to_thread(walk.all_operations)
    assert walk.wrong == [], "\n".join(dict.fromkeys(walk.wrong))
    assert walk.walked == set(NAMES)
    # The walk is useful only if it gets past authentication: many operations have to succeed at least once.
    succeeded = {name for name, found in walk.statuses.items() if any(status < 300 for status in found)}
    assert len(succeeded) > len(walk.walked) * 2 // 5
    # Each role also succeeds with its own operations.
    least = {"anonymous": 2, "operator": 10, "admin": 15, "a token for watch": 5, "a token for metrics": 1}
    assert {visitor: len(walk.let_in.get(visitor, ())) >= count for visitor, count in least.items()} == dict.fromkeys(
        least, True
    )
