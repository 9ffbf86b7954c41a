"""The id of a folder of stored files: a row names the folder that has its file, so that a file is not looked for in
another one after a move or a restore. Blocking; call it in a thread."""

from __future__ import annotations

import re
import secrets
from pathlib import Path
from typing import Final

_FILE: Final = "store-id"
_ID: Final = re.compile(r"[0-9a-f]{16}")


def open_folder(root: Path) -> str:
    """Makes the folder if it does not exist. Returns its id, or assigns one. Raises OSError."""
    root.mkdir(mode=0o700, parents=True, exist_ok=True)
    path = root / _FILE
    if not path.exists():
        written = path.with_name(f"{_FILE}.part")
        written.write_text(secrets.token_hex(8))  # written beside, so that a full disk leaves no unreadable id
        written.replace(path)
    found = path.read_text().strip()
    if not _ID.fullmatch(found):
        raise OSError(f"{path} does not hold the number of a folder")
    return found
