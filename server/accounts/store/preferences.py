"""Documents that the console stores for a user: a few named JSON documents. The tower limits their size and does not
interpret them.

Their content, and how a newer console reads an old one, is up to the console; each has its own version. There is one
document per subject, so that changes in two tabs do not overwrite each other.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import datetime
from typing import Any, Final

from sqlalchemy import func, select
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.tables import PreferenceRow
from server.kernel.refusal import Refusal

MAX_DOCUMENTS: Final = 16
MAX_DOCUMENT_BYTES: Final = 8 * 1024
"""As compact UTF-8. The settings of a gamepad take about 1 KiB each."""
MAX_DEPTH: Final = 32
"""Nesting of objects and lists. Much deeper documents can be stored, but not sent as JSON again."""


class TooManyPreferences(Refusal):
    def __init__(self) -> None:
        super().__init__(f"at most {MAX_DOCUMENTS} documents are kept for a user")


class BadPreference(Refusal):
    def __init__(self, words: str = "numbers must be finite, and text must be Unicode") -> None:
        super().__init__(words)


class PreferenceTooLarge(Refusal):
    def __init__(self, size_bytes: int) -> None:
        super().__init__(f"the document has {size_bytes} bytes; at most {MAX_DOCUMENT_BYTES} are kept")


async def preferences_of(session: AsyncSession, user_id: int) -> dict[str, dict[str, Any]]:
    """Returns every document of this user by name. Skips documents of older versions that are nested too deep."""
    rows = await session.scalars(
        select(PreferenceRow).where(PreferenceRow.user_id == user_id).order_by(PreferenceRow.name)
    )
    return {row.name: row.document for row in rows if not is_too_deep(row.document)}


async def keep_preference(
    session: AsyncSession, *, user_id: int, name: str, document: Mapping[str, Any], now: datetime
) -> None:
    """Stores the document and replaces the one of the same name; an empty one deletes it. In `Database.writing()`.

    Raises BadPreference, PreferenceTooLarge or TooManyPreferences, and then changes nothing.
    """
    if is_too_deep(document):
        raise BadPreference(f"objects and lists may be nested {MAX_DEPTH} deep")
    try:
        text = json.dumps(document, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
        size_bytes = len(text.encode())
    except ValueError as error:  # Python reads NaN and lone surrogates; other parsers would not
        raise BadPreference from error
    if size_bytes > MAX_DOCUMENT_BYTES:
        raise PreferenceTooLarge(size_bytes)
    row = await session.get(PreferenceRow, (user_id, name))
    if not document:
        if row is not None:
            await session.delete(row)
        return
    if row is not None:
        row.document, row.changed_at = dict(document), now
        return
    count = select(func.count()).select_from(PreferenceRow).where(PreferenceRow.user_id == user_id)
    if (await session.scalar(count) or 0) >= MAX_DOCUMENTS:
        raise TooManyPreferences
    session.add(PreferenceRow(user_id=user_id, name=name, document=dict(document), changed_at=now))


def is_too_deep(document: object) -> bool:
    """Goes level by level: a recursive check would fail on the very document that it must refuse."""
    level: list[object] = [document]
    for _ in range(MAX_DEPTH):
        level = [
            part
            for one in level
            if isinstance(one, Mapping | list)
            for part in (one.values() if isinstance(one, Mapping) else one)
        ]
        if not level:
            return False
    return any(isinstance(one, Mapping | list) for one in level)
