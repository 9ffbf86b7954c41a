"""`/api/v1/map/elevation`: GeoTIFFs that admins upload, and what becomes of them."""

from __future__ import annotations

from typing import Annotated, Any, Final

from fastapi import APIRouter, Query, Request

from server.http.access import Admin
from server.http.dependencies import AuditDep, DatabaseDep
from server.http.problem_docs import answers
from server.kernel.access import AdminsOnly, NotSignedIn, SessionExpired
from server.maps.api.admin_routes import FilePath, pieces_of
from server.maps.api.dependencies import ElevationUploadsDep
from server.maps.core import BadMapFile
from server.maps.io.elevation.converted import Converted
from server.maps.io.map_files import MAX_TEXT

router = APIRouter(prefix="/api/v1/map", tags=["map"], responses=answers(NotSignedIn, SessionExpired, AdminsOnly))

MEDIA_TYPE: Final = "image/tiff"
Text = Annotated[str, Query(max_length=MAX_TEXT)]
_FILE: Final[dict[str, Any]] = {
    "requestBody": {"required": True, "content": {MEDIA_TYPE: {"schema": {"type": "string", "format": "binary"}}}}
}


@router.put("/elevation/{name}", status_code=202, responses=answers(BadMapFile), openapi_extra=_FILE)
async def put_elevation_file(
    request: Request,
    admin: Admin,
    uploads: ElevationUploadsDep,
    database: DatabaseDep,
    audit: AuditDep,
    name: FilePath,
    title: Text = "",
    attribution: Text = "",
) -> None:
    """Uploads a GeoTIFF with heights of the ground, and begins to make the map file `name` of it, in place of one of
    the same name. `GET /map/admin` has the progress, and what is wrong."""
    by_whom = audit.action(admin)

    async def made(found: Converted) -> None:
        async with database.writing() as session:
            by_whom.record(session, "map.file_added", file=name, bytes=found.bytes)

    await uploads.begin(
        name,
        request.headers.get("content-length", ""),
        pieces_of(request),
        title=title or name,
        attribution=attribution,
        on_made=made,
    )


@router.delete("/elevation", status_code=204, responses=answers(BadMapFile))
async def stop_elevation(admin: Admin, uploads: ElevationUploadsDep) -> None:
    """Stops the conversion that runs, or forgets what came of the last one."""
    if not uploads.stop():
        raise BadMapFile("no GeoTIFF is being converted")
