"""Puts problem documents into the OpenAPI description, so that it lists the actual responses."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from typing import Any, Final

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from fastapi.routing import APIRoute
from starlette.routing import BaseRoute

from server.http.problem_kinds import (
    INTERNAL,
    INVALID,
    JSON_ONLY,
    MALFORMED_JSON,
    TOO_LARGE,
    WRONG_ORIGIN,
    Kind,
)
from server.http.problem_table import PROBLEMS
from server.http.request_shares import FLIES, TooManyRequests
from server.kernel.access import (
    IN_PERSON,
    NEEDS,
    WITH_ANY_PASSWORD,
    WITH_FRESH_PROOF,
    WITHOUT_DEMANDED_FACTOR,
    Action,
    BadToken,
    InPersonOnly,
    NotSignedIn,
    PasswordChangeNeeded,
    ProofNeeded,
    ScopeMissing,
    SecondFactorDemanded,
    SessionExpired,
    refusals_for_roles,
)
from server.kernel.refusal import Refusal

_REF: Final = {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}}
_SCHEMA: Final[dict[str, Any]] = {
    "title": "Problem",
    "type": "object",
    "description": "An RFC 9457 problem document.",
    "required": ["type", "title", "status"],
    "properties": {
        "type": {"type": "string", "description": "The kind of problem, for programs: /problems/<slug>"},
        "title": {"type": "string", "description": "The kind of problem, for people"},
        "status": {"type": "integer"},
        "detail": {"type": "string", "description": "Details of this case, for people"},
        "instance": {"type": "string", "description": "The requested path"},
        "item": {"type": "integer", "description": "The invalid item of a plan, from 0"},
        "count": {"type": "integer", "description": "Number known ..."},
        "total": {"type": "integer", "description": "... out of; 0: not known"},
        "kinds": {
            "type": "array",
            "description": "Accepted kinds of second factor, best first",
            "items": {"type": "string", "enum": ["passkey", "code"]},
        },
        "errors": {
            "type": "array",
            "description": "The invalid parts of the request",
            "items": {
                "type": "object",
                "required": ["in", "field", "message"],
                "properties": {
                    "in": {"type": "string", "enum": ["body", "path", "query", "header", "cookie"]},
                    "field": {"type": "string"},
                    "message": {"type": "string"},
                },
            },
        },
    },
}


def answers(*refusals: type[Refusal]) -> dict[int | str, dict[str, Any]]:
    """For the `responses` of a route: the refusals it can answer with."""
    slugs: defaultdict[int, list[str]] = defaultdict(list)
    for one in refusals:
        kind = PROBLEMS[one]
        slugs[kind.status].append(_line(kind))
    return {status: {"description": "; ".join(lines), "content": _REF} for status, lines in slugs.items()}


def describe_problems(app: FastAPI, routes: Iterable[BaseRoute]) -> None:
    """Replaces the framework's own description of errors. `routes`: all routes."""
    actions = _actions(routes)

    def build() -> dict[str, Any]:
        if app.openapi_schema is None:
            schema = get_openapi(
                title=app.title,
                version=app.version,
                description=app.description,
                routes=app.routes,
                tags=app.openapi_tags,
            )
            components = schema.setdefault("components", {}).setdefault("schemas", {})
            components.pop("HTTPValidationError", None)
            components.pop("ValidationError", None)
            components["Problem"] = _SCHEMA
            for path in schema["paths"].values():
                for method, operation in path.items():
                    _complete(method, operation, actions.get(operation["operationId"]))
            app.openapi_schema = schema
        return app.openapi_schema

    app.openapi = build  # type: ignore[method-assign]


def _actions(routes: Iterable[BaseRoute]) -> dict[str, Action]:
    """Maps each operation to the action it requires, if any."""
    found = {}
    for route in routes:
        if isinstance(route, APIRoute):
            for one in route.dependant.dependencies:
                action = getattr(one.call, "action", None)
                if action is not None:
                    found[route.operation_id or route.name] = action
    return found


def _refusals_of(action: Action) -> list[type[Refusal]]:
    """Refusals of the access check that precedes every route (`server/http/access.py`)."""
    before_sign_in: list[type[Refusal]] = [NotSignedIn, SessionExpired, BadToken]
    if action not in WITH_ANY_PASSWORD:
        before_sign_in.append(PasswordChangeNeeded)
    if action not in WITHOUT_DEMANDED_FACTOR:
        before_sign_in.append(SecondFactorDemanded)
    if NEEDS[action]:
        before_sign_in.append(ScopeMissing)
    before_sign_in.extend(refusals_for_roles(action))
    if action not in FLIES:
        before_sign_in.append(TooManyRequests)
    if action in IN_PERSON:
        before_sign_in.append(InPersonOnly)
    if action in WITH_FRESH_PROOF:
        before_sign_in.append(ProofNeeded)
    return before_sign_in


def _complete(method: str, operation: dict[str, Any], action: Action | None) -> None:
    """Adds the responses that can precede a route's own code or replace its response."""
    responses = operation["responses"]
    if "422" in responses:
        responses["422"] = {"description": _line(INVALID), "content": _REF}
    for one in _refusals_of(action) if action is not None else ():
        _add(responses, PROBLEMS[one])
    if method != "get":
        _add(responses, WRONG_ORIGIN)
    if "requestBody" in operation:
        _add(responses, MALFORMED_JSON)
    for kind in (TOO_LARGE, JSON_ONLY, INTERNAL):
        _add(responses, kind)


def _line(kind: Kind) -> str:
    return f"`{kind.slug}`: {kind.title}"


def _add(responses: dict[str, Any], kind: Kind) -> None:
    response = responses.setdefault(str(kind.status), {"description": "", "content": _REF})
    lines = [line for line in response["description"].split("; ") if line]
    if _line(kind) not in lines:
        response["description"] = "; ".join([*lines, _line(kind)])
