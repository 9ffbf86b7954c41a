"""A recording of video whose every picture says when it was taken: a strip of black and white blocks, which a test
reads from the screen. The database must exist, and the tower must not run yet."""

import secrets
import sqlite3
from contextlib import closing
from datetime import datetime, timedelta
from pathlib import Path
from typing import Final

import av
import numpy as np

from server.storage.folder_id import open_folder

WIDTH: Final = 320
HEIGHT: Final = 240
PICTURES_S: Final = 25
BITS: Final = 16
BLOCK: Final = WIDTH // BITS
STRIP_HEIGHT: Final = 40
BLACK, WHITE, GREY = 16, 235, 110

READ_PICTURE: Final = f"""video => {{
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [{WIDTH}, {STRIP_HEIGHT}];
  const context = canvas.getContext('2d', {{ willReadFrequently: true }});
  return () => {{
    context.drawImage(video, 0, 0, video.videoWidth, video.videoHeight, 0, 0, {WIDTH}, {HEIGHT});
    const {{ data }} = context.getImageData(0, {STRIP_HEIGHT // 2}, {WIDTH}, 1);
    let gray = 0;
    for (let at = {BLOCK // 2}; at < {WIDTH}; at += {BLOCK}) gray = gray * 2 + (data[4 * at] > 126 ? 1 : 0);
    let number = 0;
    for (let rest = gray; rest > 0; rest >>= 1) number ^= rest;
    return number / {PICTURES_S};
  }};
}}"""
"""JavaScript: of a video element makes a function that says how many seconds after the first one the picture on the
screen was taken."""


def strip(number: int) -> "np.ndarray[tuple[int, ...], np.dtype[np.uint8]]":
    """The brightness of a picture. The number is in Gray's code: of two pictures that follow each other one block
    differs, so half a transition says one of the two."""
    gray = number ^ number >> 1
    picture = np.full((HEIGHT, WIDTH), GREY, np.uint8)
    for bit in range(BITS):
        picture[:STRIP_HEIGHT, bit * BLOCK : (bit + 1) * BLOCK] = WHITE if gray >> (BITS - 1 - bit) & 1 else BLACK
    return picture


def write_film(path: Path, lasts_s: float) -> int:
    """Writes an MP4 (H.264, a key picture a second, as the tower makes). Returns how many pictures it has."""
    pictures = round(lasts_s * PICTURES_S)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=PICTURES_S, options={"preset": "ultrafast", "g": str(PICTURES_S)})
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        for number in range(pictures):
            picture = np.full((HEIGHT * 3 // 2, WIDTH), 128, np.uint8)
            picture[:HEIGHT] = strip(number)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="yuv420p")))
        container.mux(stream.encode(None))
    return pictures


def write_recording(
    database: Path, files: Path, *, drone_id: int, began_at: datetime, lasts_s: float, late_s: float = 0.0
) -> None:
    """Writes the file and its row: a recording that is ready. `files`: the tower's folder of files. `late_s`: how long
    after its beginning the first picture was taken."""
    root = files / "recordings"
    store = open_folder(root)
    stem = secrets.token_hex(8)
    path = root / f"drone-{drone_id}" / f"{stem}.mp4"
    path.parent.mkdir(mode=0o700, exist_ok=True)
    pictures = write_film(path, lasts_s - late_s)
    row = {
        "drone_id": drone_id,
        "store": store,
        "file": stem,
        "by_name": "alice",
        "quality": "high",
        "codec": "h264",
        "state": "ready",
        "words": "",
        "began_at": began_at.replace(tzinfo=None).isoformat(" "),
        "first_picture_at": (began_at + timedelta(seconds=late_s)).replace(tzinfo=None).isoformat(" "),
        "ended_at": (began_at + timedelta(seconds=lasts_s)).replace(tzinfo=None).isoformat(" "),
        "flights": "[]",
        "size_bytes": path.stat().st_size,
        "duration_s": lasts_s - late_s,
        "pictures": pictures,
        "width": WIDTH,
        "height": HEIGHT,
    }
    with closing(sqlite3.connect(database)) as connection, connection:
        names = ", ".join(row)
        connection.execute(f"INSERT INTO recordings ({names}) VALUES ({', '.join('?' * len(row))})", [*row.values()])
