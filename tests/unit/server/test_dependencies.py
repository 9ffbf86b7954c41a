"""Routes receive what they use: only the dependencies read the application's state."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from inspect import isasyncgenfunction, iscoroutinefunction
from pathlib import Path

import pytest
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute, APIWebSocketRoute

import server
from server.app.routers import ROUTERS

ROOT = Path(server.__file__).parent
THE_ONE = ROOT / "http" / "dependencies.py"
ROUTES = [route for router in ROUTERS for route in router.routes if isinstance(route, APIRoute | APIWebSocketRoute)]


def state_reads(source: str) -> list[str]:
    """Returns expressions like `app.state` and `request.app.state`."""
    return [
        ast.unparse(node)
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Attribute)
        and node.attr == "state"
        and ast.unparse(node.value).rpartition(".")[2] in {"app", "_app"}
    ]


def test_only_the_dependencies_read_the_state_of_the_application() -> None:
    readers = {path for path in ROOT.rglob("*.py") if state_reads(path.read_text())}
    assert readers == {THE_ONE}


def _calls(dependant: Dependant) -> Iterator[object]:
    for one in dependant.dependencies:
        yield one.call
        yield from _calls(one)


@pytest.mark.parametrize("route", ROUTES, ids=lambda route: f"{route.path} {route.name}")
def test_no_dependency_runs_in_a_thread(route: APIRoute | APIWebSocketRoute) -> None:
    """FastAPI runs plain functions in a thread pool: a hand-over to a thread for each dependency of each request."""
    slow = [one for one in _calls(route.dependant) if not (iscoroutinefunction(one) or isasyncgenfunction(one))]
    assert not slow
