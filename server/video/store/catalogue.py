"""The database rows of recordings. Every function takes a session; a change and its audit record are committed
together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, Final

from sqlalchemy import func, select
from sqlalchemy.ext.asyncio import AsyncSession

from server.audit.store.action import AuditAction
from server.kernel.people import Principal
from server.live.live_drone import LiveDrone
from server.video.core.recordings.refusals import RecordingBusy, UnknownRecording
from server.video.core.recordings.views import RecordedByView, RecordingView
from server.video.store.tables import RecordingRow

MAX_LISTED: Final = 500
OPEN_STATES: Final = ("recording", "finishing")
_MAX_TEXT_LENGTH: Final = 200


@dataclass(frozen=True)
class Finished:
    """The content of the file. Sizes in pixels; `pictures`: those that could be decoded. `first_lag_s`: by how much it
    begins before its first picture came, if the time of capture is not known; otherwise 0."""

    duration_s: float
    width: int
    height: int
    pictures: int
    first_lag_s: float


async def of_drone(session: AsyncSession, drone_id: int) -> Sequence[RecordingRow]:
    """Newest first."""
    query = select(RecordingRow).where(RecordingRow.drone_id == drone_id)
    return (await session.scalars(query.order_by(RecordingRow.id.desc()).limit(MAX_LISTED))).all()


async def get(session: AsyncSession, drone_id: int, recording_id: int, *, lock: bool = False) -> RecordingRow:
    """Raises UnknownRecording."""
    query = select(RecordingRow).where(RecordingRow.id == recording_id, RecordingRow.drone_id == drone_id)
    row = await session.scalar(query.with_for_update() if lock else query)
    if row is None:
        raise UnknownRecording
    return row


async def known_to(session: AsyncSession, viewer: Principal, drone: LiveDrone, recording_id: int) -> RecordingRow:
    """Raises UnknownRecording also for a recording made before the drone joined this user's team."""
    row = await get(session, drone.drone_id, recording_id)
    if not drone.knows_of(viewer.user_id, viewer.role, row.began_at):
        raise UnknownRecording
    return row


async def delete(session: AsyncSession, drone_id: int, recording_id: int, *, action: AuditAction) -> RecordingRow:
    """Raises UnknownRecording, RecordingBusy."""
    row = await get(session, drone_id, recording_id, lock=True)
    if row.state in OPEN_STATES:
        raise RecordingBusy
    await _remove(session, row, "recording.deleted", action)
    return row


async def remove_to_make_space(session: AsyncSession, recording_id: int, *, action: AuditAction) -> RecordingRow | None:
    """None if it is already gone, or may no longer be removed."""
    row = await session.get(RecordingRow, recording_id)
    if row is None or row.state in OPEN_STATES:
        return None
    await _remove(session, row, "recording.removed", action)
    return row


async def _remove(session: AsyncSession, row: RecordingRow, event: str, action: AuditAction) -> None:
    action.record(session, event, drone_id=row.drone_id, **about(row))
    await session.delete(row)


def about(row: RecordingRow) -> dict[str, Any]:
    """What the audit trail records about a recording."""
    return {"recording": row.id, "quality": row.quality, "began_at": row.began_at.isoformat()}


async def mark_ended(
    session: AsyncSession,
    recording_id: int,
    *,
    words: str,
    at: datetime,
    size_bytes: int,
    pictures: int,
    first_picture_at: datetime | None,
    flights: Iterable[datetime],
    action: AuditAction,
) -> RecordingRow | None:
    """The recording has ended and its file is due. None if the row is gone with its drone. A second call is
    harmless."""
    row = await session.get(RecordingRow, recording_id)
    if row is None or row.state != "recording":
        return row
    row.state, row.words, row.ended_at = "finishing", words[:_MAX_TEXT_LENGTH], at
    row.size_bytes, row.pictures, row.first_picture_at = size_bytes, pictures, first_picture_at
    row.flights = [one.isoformat() for one in flights]
    detail = about(row) | ({"words": row.words} if words else {})
    action.record(session, "recording.ended", drone_id=row.drone_id, **detail)
    return row


async def mark_ready(
    session: AsyncSession, recording_id: int, finished: Finished, *, size_bytes: int
) -> RecordingRow | None:
    """The file is ready. None if the row is gone meanwhile."""
    row = await session.get(RecordingRow, recording_id)
    if row is not None:
        row.state, row.size_bytes, row.duration_s = "ready", size_bytes, finished.duration_s
        row.width, row.height, row.pictures = finished.width, finished.height, finished.pictures
        if row.first_picture_at is not None:
            row.first_picture_at -= timedelta(seconds=finished.first_lag_s)
    return row


async def mark_failed(session: AsyncSession, recording_id: int, words: str, *, size_bytes: int) -> RecordingRow | None:
    """`size_bytes`: of the files that remain on disk for another attempt."""
    row = await session.get(RecordingRow, recording_id)
    if row is not None:
        row.state, row.words, row.size_bytes = "failed", words[:_MAX_TEXT_LENGTH], size_bytes
    return row


async def all_of_store(session: AsyncSession, store: str) -> Sequence[RecordingRow]:
    """Oldest first."""
    query = select(RecordingRow).where(RecordingRow.store == store)
    return (await session.scalars(query.order_by(RecordingRow.began_at, RecordingRow.id))).all()


async def bytes_of_store(session: AsyncSession, store: str) -> tuple[dict[int, int], dict[int, int]]:
    """Returns bytes by drone: (of recordings being finished, of all that are over). The database sums, whatever their
    number."""
    columns = RecordingRow.drone_id, RecordingRow.state
    query = select(*columns, func.sum(RecordingRow.size_bytes)).where(RecordingRow.store == store).group_by(*columns)
    finishing, over = Counter[int](), Counter[int]()
    for drone_id, state, total in await session.execute(query):
        if state == "finishing":
            finishing[drone_id] += int(total)
        elif state not in OPEN_STATES:
            over[drone_id] += int(total)
    return finishing, over


async def oldest_over(
    session: AsyncSession, store: str, drone_ids: Iterable[int], *, most: int
) -> Sequence[RecordingRow]:
    """The oldest of some drones' recordings that are over."""
    query = select(RecordingRow).where(
        RecordingRow.store == store, RecordingRow.state.not_in(OPEN_STATES), RecordingRow.drone_id.in_(list(drone_ids))
    )
    return (await session.scalars(query.order_by(RecordingRow.began_at, RecordingRow.id).limit(most))).all()


async def over_before(session: AsyncSession, store: str, before: datetime, *, at_most: int) -> Sequence[RecordingRow]:
    """The oldest recordings that are over and began before then."""
    query = select(RecordingRow).where(
        RecordingRow.store == store, RecordingRow.state.not_in(OPEN_STATES), RecordingRow.began_at < before
    )
    return (await session.scalars(query.order_by(RecordingRow.began_at, RecordingRow.id).limit(at_most))).all()


def view_of(row: RecordingRow) -> RecordingView:
    """Returns the external view."""
    return RecordingView.model_validate(
        {
            "id": row.id,
            "drone_id": row.drone_id,
            "by": RecordedByView(id=row.by_id, name=row.by_name),
            "state": row.state,
            "words": row.words,
            "quality": row.quality,
            "codec": row.codec,
            "began_at": row.began_at,
            "first_picture_at": row.first_picture_at,
            "ended_at": row.ended_at,
            "flights": row.flights,
            "size_bytes": row.size_bytes,
            "duration_s": row.duration_s,
            "pictures": row.pictures,
            "width": row.width,
            "height": row.height,
        }
    )
