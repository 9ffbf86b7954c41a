"""The tower against its own description: every operation, asked by everybody, with what the schema allows and forbids.

Schemathesis makes the requests from `/api/v1/openapi.json` and holds the answers against it. No answer is covered by
a catch-all: each status that comes has to be declared for its operation, each body has to fit its schema. Derandomized:
the same requests at each run.
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
from hypothesis import strategies as st
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
from tower_world import TowerWorld, start_tower

from server.access import COOKIE
from server.accounts.tables import Role
from server.app import ROUTERS

# All of it now, before there are threads: pytest reads the source of its plugins, and Python 3.11 cannot parse in two
# threads at once ("AST constructor recursion depth mismatch").
for found in pkgutil.walk_packages(schemathesis.specs.openapi.__path__, "schemathesis.specs.openapi."):
    importlib.import_module(found.name)

CHECKS: Final = [
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
    unsupported_method,
]
EXAMPLES: Final = 3
"""Of each operation, of each kind, sent by each visitor."""
VISITORS: Final = ("anonymous", "operator", "admin")


@dataclass
class Scene:
    """Fresh for each operation, because some of them end sessions, delete users and take drones away."""

    cookies: dict[str, dict[str, str]]
    ids: dict[str, int]


@dataclass
class Walk:
    """Every operation of the schema, in a thread beside the loop in which the tower runs."""

    world: TowerWorld
    loop: asyncio.AbstractEventLoop
    wrong: list[str] = field(default_factory=list)
    walked: set[str] = field(default_factory=set)
    statuses: dict[str, set[int]] = field(default_factory=dict)

    def all_operations(self) -> None:
        schema = schemathesis.openapi.from_url(f"{self.world.base_url}/api/v1/openapi.json")
        for number, found in enumerate(schema.get_all_operations()):
            operation = found.ok()
            name = str(operation.definition.raw["operationId"])
            self.walked.add(name)
            scene = asyncio.run_coroutine_threadsafe(set_the_scene(self.world, number), self.loop).result(20)
            for mode in (GenerationMode.POSITIVE, GenerationMode.NEGATIVE):
                # An operation with nothing that could be wrong has no bad requests.
                with suppress(Unsatisfiable):
                    self._send(name, operation.as_strategy(generation_mode=mode), scene, mode)

    def _send(self, name: str, strategy: Any, scene: Scene, mode: GenerationMode) -> None:
        checks = [*CHECKS, negative_data_rejection] if mode is GenerationMode.NEGATIVE else CHECKS

        @settings(
            max_examples=EXAMPLES,
            derandomize=True,
            database=None,
            deadline=None,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        @given(case=strategy, hits=st.booleans())
        def ask(case: Case, hits: bool) -> None:
            if hits and mode is GenerationMode.POSITIVE:
                # Of what is there, or nearly every path would end with "there is no such drone".
                known = scene.ids.items() & {(key, scene.ids.get(key)) for key in case.path_parameters or {}}
                case.path_parameters.update(known)
            for visitor in VISITORS:
                self._one(name, visitor, case, scene, checks)

        ask()

    def _one(self, name: str, visitor: str, case: Case, scene: Scene, checks: list[Any]) -> None:
        answer = case.call(base_url=self.world.base_url, cookies=scene.cookies[visitor])
        self.statuses.setdefault(name, set()).add(answer.status_code)
        # What is wrong with a request is not looked at before it is known who asks.
        refused = answer.status_code in (401, 403)
        try:
            case.validate_response(
                answer, checks=[one for one in checks if not (refused and one is negative_data_rejection)]
            )
        except (FailureGroup, AssertionError) as failure:
            told = [str(one) for one in getattr(failure, "exceptions", [failure])]
            self.wrong += [f"{name} as {visitor} ({answer.status_code}): {one[:400]}" for one in told]


async def set_the_scene(world: TowerWorld, number: int) -> Scene:
    """An operator with a drone, an admin, and one of everything that has an id."""
    now = world.clock()
    people = {
        "operator": await world.add_user(f"operator {number}"),
        "admin": await world.add_user(f"admin {number}", Role.ADMIN),
    }
    drone = await world.add_drone(f"drone {number}", people["operator"])
    cookies: dict[str, dict[str, str]] = {"anonymous": {}}
    async with world.database.writing() as session:
        for visitor, person in people.items():
            begun = await world.tower.sessions.begin(session, user_id=person.id, now=now, address="", user_agent="")
            cookies[visitor] = {COOKIE: begun.token}
        spare = await world.tower.sessions.begin(
            session, user_id=people["operator"].id, now=now, address="", user_agent=""
        )
    return Scene(cookies, {"drone_id": drone.id, "user_id": people["operator"].id, "session_id": spare.session_id})


@pytest.fixture
async def walk(tmp_path: Path) -> Any:
    async with start_tower(tmp_path) as world:
        yield Walk(world, asyncio.get_running_loop())


async def test_every_operation_keeps_to_the_schema_whoever_asks(walk: Walk) -> None:
    await asyncio.to_thread(walk.all_operations)
    assert walk.wrong == [], "\n".join(dict.fromkeys(walk.wrong))
    assert walk.walked == {
        route.operation_id or route.name
        for router in ROUTERS
        for route in router.routes
        if isinstance(route, APIRoute) and route.include_in_schema
    }
    # The walk is worth something only where it comes through the door: many operations have to succeed at least once.
    succeeded = {name for name, found in walk.statuses.items() if any(status < 300 for status in found)}
    assert len(succeeded) > len(walk.walked) * 2 // 5
