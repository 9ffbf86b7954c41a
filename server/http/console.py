"""Serves the console from its build folder. Every path outside the API that is no file leads to the console.

Files are sent with an ETag, and compressed if the build has put a compressed copy beside them. Browsers keep files with
a hash in the name forever. They revalidate all others, and get 304 while a file is unchanged.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from mimetypes import guess_type
from pathlib import Path
from typing import Final

from fastapi import FastAPI
from fastapi.responses import FileResponse, PlainTextResponse, RedirectResponse
from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from server.http.content_coding import copy_for

NOT_BUILT: Final = "The console has not been built yet. Run `make setup`, or `npm ci && npm run build` in web/.\n"
FOR_EVER: Final = "public, max-age=31536000, immutable"
"""The build puts a hash of the content into the names of files in assets/."""
UNCHANGED_KEEPS: Final = frozenset({"cache-control", "etag", "vary"})
"""Headers of a 304 response."""


class ConsoleFile(FileResponse):
    """Anybody may ask for many at a time and read none: each holds two pieces of this size in memory."""

    chunk_size = 16 * 1024


def serve_console(app: FastAPI, folder: Path, texts: Mapping[str, Callable[[], str | None]]) -> None:
    """Answers every path that no route of the API knows, so that a known path with a wrong method stays a 405. `texts`:
    texts at paths of their own; None: not found."""
    no_such_route = app.router.default

    async def console(scope: Scope, receive: Receive, send: Send) -> None:
        path: str = scope["path"].removeprefix("/")
        if scope["type"] != "http" or path == "api" or path.startswith("api/"):
            await no_such_route(scope, receive, send)
            return
        if scope["method"] not in {"GET", "HEAD"}:
            raise HTTPException(405, headers={"Allow": "GET, HEAD"})
        if path in texts:
            text = texts[path]()
            if text is None:
                raise HTTPException(404)
            await PlainTextResponse(text, headers={"Cache-Control": "no-cache"})(scope, receive, send)
            return
        answer = await asyncio.to_thread(_answer, folder, path, Headers(scope=scope))
        await answer(scope, receive, send)

    app.router.default = console


def _answer(folder: Path, path: str, asked: Headers) -> Response:
    index = folder / "index.html"
    if not index.is_file():
        return PlainTextResponse(NOT_BUILT, status_code=503, headers={"Cache-Control": "no-store"})
    wanted = _inside(folder, path)
    if wanted is not None:
        return _file(wanted, asked, FOR_EVER if path.startswith("assets/") else "no-cache")
    if "." in path.rpartition("/")[2]:
        raise HTTPException(404)  # a missing file is not a page
    if path:
        return RedirectResponse("/", 303)  # pages are behind the #; below this path the console would miss its files
    return _file(index, asked, "no-cache")


def _file(file: Path, asked: Headers, cache: str) -> Response:
    copy, coding = copy_for(file, asked.get("accept-encoding", ""))
    headers = {"Cache-Control": cache, "Vary": "Accept-Encoding"}
    if coding is not None:
        headers["Content-Encoding"] = coding
    # The type is that of the file, not of its compressed copy. Each copy has its own ETag.
    answer = ConsoleFile(copy, headers=headers, media_type=guess_type(file.name)[0], stat_result=copy.stat())
    known = {tag.strip().removeprefix("W/") for tag in asked.get("if-none-match", "").split(",")}
    if answer.headers["etag"] in known:
        kept = {name: value for name, value in answer.headers.items() if name in UNCHANGED_KEEPS}
        return Response(status_code=304, headers=kept)
    return answer


def _inside(folder: Path, path: str) -> Path | None:
    """Returns the file that `path` names, if it exists and really lies inside the folder."""
    if not path or "\0" in path:
        return None
    root = folder.resolve()
    try:
        wanted = (root / path).resolve()
        return wanted if wanted.is_relative_to(root) and wanted.is_file() else None
    except OSError:  # a name that no file can have, such as one of 300 letters
        return None
