"""Serves the console that was built into a folder. Every path that is not the API's is a page of the application."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Final

from fastapi import FastAPI
from fastapi.responses import FileResponse, PlainTextResponse
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.types import Receive, Scope, Send

NOT_BUILT: Final = "The console has not been built yet. Run `make setup`, or `npm ci && npm run build` in web/.\n"
FOR_EVER: Final = "public, max-age=31536000, immutable"
"""The build puts a hash of the content into the names of what is in assets/."""


def serve_console(app: FastAPI, folder: Path) -> None:
    """Answers whatever no route of the API knows, so that a known path with a wrong method stays a 405."""
    no_such_route = app.router.default

    async def console(scope: Scope, receive: Receive, send: Send) -> None:
        path: str = scope["path"].removeprefix("/")
        if scope["type"] != "http" or path == "api" or path.startswith("api/"):
            await no_such_route(scope, receive, send)
            return
        if scope["method"] not in {"GET", "HEAD"}:
            raise HTTPException(405, headers={"Allow": "GET, HEAD"})
        answer = await asyncio.to_thread(_answer, folder, path)
        await answer(scope, receive, send)

    app.router.default = console


def _answer(folder: Path, path: str) -> Response:
    index = folder / "index.html"
    if not index.is_file():
        return PlainTextResponse(NOT_BUILT, status_code=503, headers={"Cache-Control": "no-store"})
    wanted = _inside(folder, path)
    if wanted is not None:
        hashed = path.startswith("assets/")
        return FileResponse(wanted, headers={"Cache-Control": FOR_EVER if hashed else "no-cache"})
    if "." in path.rpartition("/")[2]:
        raise HTTPException(404)  # a file that is not there is not a page
    return FileResponse(index, headers={"Cache-Control": "no-cache"})


def _inside(folder: Path, path: str) -> Path | None:
    """The file that `path` names, if there is one and it is truly inside the folder."""
    if not path or "\0" in path:
        return None
    root = folder.resolve()
    wanted = (root / path).resolve()
    return wanted if wanted.is_relative_to(root) and wanted.is_file() else None
