"""The answer with a finished video, and how the API reference describes it."""

import asyncio
from datetime import datetime
from pathlib import Path
from typing import Any, Final

from fastapi.responses import FileResponse

MEDIA_TYPE: Final = "video/mp4"
VIDEO_ANSWERS: Final[dict[int | str, dict[str, Any]]] = {
    200: {"content": {MEDIA_TYPE: {}}, "description": "The whole video, in MP4"},
    206: {"content": {MEDIA_TYPE: {}}, "description": "The range that was asked for"},
    400: {"description": "The range cannot be read"},
    416: {"description": "The file has no such range"},
}


async def video_answer(
    path: Path, missing: type[Exception], *, drone: str, began_at: datetime, suffix: str = ""
) -> FileResponse:
    """Raises `missing` if there is no file. `suffix`: of its name."""
    if not await asyncio.to_thread(path.is_file):
        raise missing
    name = f"{drone}-{began_at:%Y%m%d-%H%M%S}{suffix}.mp4"
    return FileResponse(path, media_type=MEDIA_TYPE, filename=name, headers={"Cache-Control": "private, no-cache"})
