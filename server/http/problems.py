"""Maps errors to HTTP in one place: RFC 9457 problem documents. The table is in `problem_table.py`.

A response never repeats any part of a request's body, because it may be a password.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from http import HTTPStatus
from typing import Any, Final

import structlog
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from server.control.store.service import ControlRefused
from server.http.field_errors import field_error
from server.http.problem_kinds import (
    BODY_TIMEOUT,
    DATABASE,
    INTERNAL,
    INVALID,
    MALFORMED_JSON,
    NOT_THE_TOWER,
    TOO_LARGE,
    Kind,
)
from server.http.problem_table import PROBLEMS
from server.kernel.access import BadToken
from server.kernel.refusal import Refusal, RetryLater
from server.storage.database import DatabaseUnavailable, LockLost

_log = structlog.get_logger(__name__)
MAX_ERRORS: Final = 50
"""Of one answer: more do not help anybody."""
MEDIA_TYPE: Final = "application/problem+json"
NOT_ALLOWED: Final = frozenset({"admins-only", "not-an-owner"})
"""Codes of control refusals that depend on the user, not on the situation."""


def problem(
    kind: Kind,
    *,
    instance: str,
    detail: str | None = None,
    errors: Sequence[dict[str, str]] = (),
    headers: dict[str, str] | None = None,
    more: Mapping[str, Any] | None = None,
) -> JSONResponse:
    document: dict[str, Any] = {"type": f"/problems/{kind.slug}", "title": kind.title, "status": kind.status}
    if detail:
        document["detail"] = detail
    document["instance"] = instance
    if errors:
        document["errors"] = list(errors)
    document |= more or {}
    return JSONResponse(document, status_code=kind.status, media_type=MEDIA_TYPE, headers=headers)


def kind_of(refusal: Refusal) -> Kind:
    kind = next((PROBLEMS[one] for one in type(refusal).__mro__ if one in PROBLEMS), INTERNAL)
    if isinstance(refusal, ControlRefused):
        # The control table has a code for each refusal, so that programs can tell them apart.
        status = 403 if refusal.code in NOT_ALLOWED else kind.status
        return replace(kind, slug=refusal.code, status=status)
    return kind


def refusal_problem(refusal: Refusal, *, instance: str) -> JSONResponse:
    kind = kind_of(refusal)
    headers: dict[str, str] = {}
    if isinstance(refusal, RetryLater):
        headers["Retry-After"] = str(max(1, math.ceil(refusal.retry_after_s)))
    if kind.status == HTTPStatus.UNAUTHORIZED:
        headers["WWW-Authenticate"] = "Bearer" if isinstance(refusal, BadToken) else "Cookie"
    field = getattr(refusal, "field", None) or kind.field
    errors = [{"in": "body", "field": field, "message": refusal.message}] if field else []
    detail = refusal.message if kind is not INTERNAL else None
    more = dict(getattr(refusal, "more", None) or {})
    item = getattr(refusal, "item", None)
    if item is not None:
        more["item"] = item
    return problem(kind, instance=instance, detail=detail, errors=errors, headers=headers, more=more)


def handle_problems(app: FastAPI) -> None:
    app.add_exception_handler(Refusal, _on_refusal)
    app.add_exception_handler(DatabaseUnavailable, _on_database)
    app.add_exception_handler(RequestValidationError, _on_invalid)
    app.add_exception_handler(HTTPException, _on_http)


async def _on_database(request: Request, error: Exception) -> JSONResponse:
    _log.error("database_unavailable", path=request.url.path, error=str(error))
    lost = isinstance(error, LockLost)
    detail = str(error)
    headers = {"Retry-After": "1"}
    return problem(NOT_THE_TOWER if lost else DATABASE, instance=request.url.path, detail=detail, headers=headers)


async def _on_refusal(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, Refusal)
    return refusal_problem(error, instance=request.url.path)


async def _on_invalid(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    # FastAPI keeps the error in a variable of a frame that it passed through, a cycle with all data of the request.
    for raised in (error, error.__cause__):
        if raised is not None:
            raised.__traceback__ = None
    found = error.errors()[:MAX_ERRORS]
    if any(one["type"] == "json_invalid" for one in found):
        return problem(MALFORMED_JSON, instance=request.url.path)
    errors = [
        {
            "in": str(one["loc"][0]) if one["loc"] else "body",
            "field": ".".join(str(step) for step in one["loc"][1:]),
            "message": field_error(one),
        }
        for one in found
    ]
    named = ", ".join(sorted({one["field"] for one in errors if one["field"]}))
    detail = f"not valid: {named}" if named else "a JSON object is required"
    return problem(INVALID, instance=request.url.path, detail=detail, errors=errors)


async def _on_http(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    for kind in (TOO_LARGE, BODY_TIMEOUT):
        if error.status_code == kind.status:
            return problem(kind, instance=request.url.path, headers=dict(error.headers or {}))
    status = HTTPStatus(error.status_code)
    kind = Kind(status.phrase.lower().replace(" ", "-"), status.value, status.phrase)
    return problem(kind, instance=request.url.path, headers=dict(error.headers or {}))
