"""Serves the OpenAPI document. Strangers may read it: it is made once, beside the event loop, and is then a file."""

from __future__ import annotations

import asyncio
import gzip
import hashlib
from typing import Final, NamedTuple

import msgspec
from fastapi import FastAPI
from starlette.requests import Request
from starlette.responses import Response

from server.http.content_coding import accepted_codings
from server.runtime.side_thread import TOWERS_OWN, SideThread

PATH: Final = "/api/v1/openapi.json"
MEDIA_TYPE: Final = "application/json"


class _Made(NamedTuple):
    plain: bytes
    gzipped: bytes
    etag: str


def serve_openapi(app: FastAPI, side: SideThread) -> None:
    """Call it once `app.openapi` is what is to be served."""
    made: asyncio.Future[_Made] | None = None

    async def openapi(request: Request) -> Response:
        nonlocal made
        if made is None:
            made = asyncio.ensure_future(side.in_turn(TOWERS_OWN, lambda: _make(app)))
        document = await asyncio.shield(made)
        headers = {"ETag": document.etag, "Vary": "Accept-Encoding", "Cache-Control": "no-cache"}
        if request.headers.get("if-none-match") == document.etag:
            return Response(status_code=304, headers=headers)
        if "gzip" in accepted_codings(request.headers.get("accept-encoding", "")):
            return Response(document.gzipped, media_type=MEDIA_TYPE, headers=headers | {"Content-Encoding": "gzip"})
        return Response(document.plain, media_type=MEDIA_TYPE, headers=headers)

    app.add_route(PATH, openapi, include_in_schema=False)


def _make(app: FastAPI) -> _Made:
    plain = msgspec.json.encode(app.openapi())
    return _Made(plain, gzip.compress(plain, mtime=0), f'"{hashlib.sha256(plain).hexdigest()[:16]}"')
