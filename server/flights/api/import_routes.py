"""`/api/v1/flight-imports`: flights from files of other programs, converted for the replay."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Annotated, Any, Final

from fastapi import APIRouter, Path, Query, Request, Response
from fastapi.responses import FileResponse
from starlette.requests import ClientDisconnect

from server.flights.core.imports.refusals import BadFlightFile, ImportsFull, UnknownImport
from server.flights.core.imports.views import ImportedFlightView
from server.flights.store.imports.service import FlightImports
from server.http.access import Pilot, Viewer
from server.http.dependencies import AuditDep, DatabaseDep, provided
from server.http.problem_docs import answers
from server.kernel.access import Action, reaches, reaches_all
from server.kernel.people import Principal, UserRef
from wire.ids import UserId

FlightImportsDep = Annotated[FlightImports, provided(FlightImports)]
router = APIRouter(prefix="/api/v1/flight-imports", tags=["flights"])

MEDIA_TYPE: Final = "application/octet-stream"
MAX_FILE_NAME: Final = 200
ImportPath = Annotated[str, Path(pattern=r"^[0-9a-f]{16}$")]
_FILE: Final[dict[str, Any]] = {
    "requestBody": {"required": True, "content": {MEDIA_TYPE: {"schema": {"type": "string", "format": "binary"}}}}
}


async def _known(imports: FlightImports, principal: Principal, import_id: str) -> ImportedFlightView:
    """Raises UnknownImport for those of others, too: they look like none."""
    view = await imports.get(import_id)
    if not reaches(principal, Action.SEE_SQUAD, UserId(view.by.id)):
        raise UnknownImport
    return view


@router.get("")
async def list_flight_imports(principal: Viewer, imports: FlightImportsDep) -> list[ImportedFlightView]:
    """Lists the imported flights of this user, for admins those of everybody, newest upload first."""
    return await imports.listed(None if reaches_all(principal.role, Action.SEE_SQUAD) else principal.user_id)


@router.post("", status_code=201, responses=answers(BadFlightFile, ImportsFull), openapi_extra=_FILE)
async def import_flight(
    request: Request,
    principal: Pilot,
    imports: FlightImportsDep,
    database: DatabaseDep,
    audit: AuditDep,
    name: Annotated[str, Query(max_length=MAX_FILE_NAME, description="Of the file")] = "",
) -> ImportedFlightView:
    """Takes a `.tlog`, a dataflash log of ArduPilot (`.bin`) or a ULog of PX4 (`.ulg`), and makes a telemetry log of
    it. The flight belongs to the user. The answer comes when it is converted."""
    by = UserRef(principal.user_id, principal.name)
    view = await imports.add(by, name, request.headers.get("content-length", ""), _pieces(request))
    async with database.writing() as session:
        audit.action(principal).record(session, "flight.imported", flight=view.id, name=view.name, format=view.format)
    return view


@router.get("/{import_id}", responses=answers(UnknownImport))
async def get_flight_import(principal: Viewer, imports: FlightImportsDep, import_id: ImportPath) -> ImportedFlightView:
    """Returns one imported flight."""
    return await _known(imports, principal, import_id)


@router.get(
    "/{import_id}/tlog",
    response_class=Response,
    responses={
        200: {"content": {MEDIA_TYPE: {}}, "description": "The telemetry log"},
        206: {"content": {MEDIA_TYPE: {}}, "description": "A range of it"},
        **answers(UnknownImport),
    },
)
async def get_flight_import_tlog(principal: Viewer, imports: FlightImportsDep, import_id: ImportPath) -> FileResponse:
    """Downloads the telemetry log that was made of the file."""
    view = await _known(imports, principal, import_id)
    path = imports.path(view)
    if not await asyncio.to_thread(path.is_file):
        raise UnknownImport
    headers = {"Cache-Control": "private, no-cache"}
    return FileResponse(path, media_type=MEDIA_TYPE, filename=f"{view.name}.tlog", headers=headers)


@router.delete("/{import_id}", status_code=204, responses=answers(UnknownImport))
async def delete_flight_import(
    principal: Pilot, imports: FlightImportsDep, database: DatabaseDep, audit: AuditDep, import_id: ImportPath
) -> None:
    """Deletes an imported flight for good."""
    view = await _known(imports, principal, import_id)
    async with database.writing() as session:
        audit.action(principal).record(session, "flight.import_deleted", flight=view.id, name=view.name)
    await imports.delete(view)


async def _pieces(request: Request) -> AsyncIterator[bytes]:
    try:
        async for piece in request.stream():
            yield piece
    except ClientDisconnect:
        raise BadFlightFile("the connection broke off") from None
