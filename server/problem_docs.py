"""Puts problem documents into the OpenAPI description, so that it says what is really answered."""

from __future__ import annotations

from collections import defaultdict
from http import HTTPStatus
from typing import Any, Final

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi

from server.problems import PROBLEMS
from server.refusal import Refusal

_REF: Final = {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}}
_SCHEMA: Final[dict[str, Any]] = {
    "title": "Problem",
    "type": "object",
    "description": "An RFC 9457 problem document.",
    "required": ["type", "title", "status"],
    "properties": {
        "type": {"type": "string", "description": "Which problem, for programs: /problems/<slug>"},
        "title": {"type": "string", "description": "The same in words"},
        "status": {"type": "integer"},
        "detail": {"type": "string", "description": "More about this one case, for people"},
        "instance": {"type": "string", "description": "The path that was asked for"},
        "errors": {
            "type": "array",
            "description": "Which parts of the request were at fault",
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
    """For the `responses` of a route: the refusals it may answer with."""
    slugs: defaultdict[int, list[str]] = defaultdict(list)
    for one in refusals:
        kind = PROBLEMS[one]
        slugs[kind.status].append(f"`{kind.slug}`: {kind.title}")
    return {status: {"description": "; ".join(lines), "content": _REF} for status, lines in slugs.items()}


def describe_problems(app: FastAPI) -> None:
    """Replaces the framework's own description of errors."""

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
                    _complete(method, operation["responses"])
            app.openapi_schema = schema
        return app.openapi_schema

    app.openapi = build  # type: ignore[method-assign]


def _complete(method: str, responses: dict[str, Any]) -> None:
    if "422" in responses:
        responses["422"] = {"description": "`invalid-request`: The request is not valid", "content": _REF}
    if method != "get":
        responses.setdefault("403", {"description": HTTPStatus.FORBIDDEN.phrase, "content": _REF})
        responses["403"]["description"] += "; `wrong-origin`: The request came from another site"
    responses["default"] = {"description": "Any other problem", "content": _REF}
