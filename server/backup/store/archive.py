"""The archive of a backup: a tar file whose last member lists all others, with sizes and checksums. Blocking.

`database/TABLE.jsonl.gz`, `keys/secret.key`, `files/...`, `manifest.json`. It holds every secret of the tower, so only
its owner may read it. It appears under its name when it is complete, and never replaces another file.
"""

from __future__ import annotations

import hashlib
import io
import os
import tarfile
from contextlib import suppress
from pathlib import Path, PurePosixPath
from types import TracebackType
from typing import IO, Any, Final

import msgspec

FORMAT: Final = 1
MANIFEST: Final = "manifest.json"
DATABASE: Final = "database/"
KEYS: Final = "keys/secret.key"
FILES: Final = "files/"
MAX_MANIFEST_BYTES: Final = 256 * 1024 * 1024
_PIECE: Final = 1024 * 1024


class BadArchive(Exception):
    """The message says what is wrong with the file."""


class Member(msgspec.Struct, frozen=True):
    size_bytes: int
    sha256: str


class Manifest(msgspec.Struct, frozen=True, kw_only=True):
    """`tables`: rows of each; `counters`: the highest ids ever used; `skipped`: files that vanished meanwhile."""

    format: int
    made_at: str
    version: str
    revision: str
    kind: str
    tables: dict[str, int]
    counters: dict[str, int]
    members: dict[str, Member]
    skipped: int = 0


class _Hashing(io.RawIOBase):
    """Hashes what is read of a file."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self.hash = hashlib.sha256()

    def read(self, size: int = -1) -> bytes:
        piece = self._file.read(size)
        self.hash.update(piece)
        return piece


class ArchiveWriter:
    """Writes beside `path`; `finish` gives the file its name, leaving the block without it removes it."""

    def __init__(self, path: Path) -> None:
        if path.exists():
            raise BadArchive(f"{path} is there already: choose another name")
        self._path = path
        self._part = path.with_name(f".{path.name}.{os.getpid()}.part")
        descriptor = os.open(self._part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        self._file = os.fdopen(descriptor, "wb")
        self._tar = tarfile.open(fileobj=self._file, mode="w", format=tarfile.PAX_FORMAT)  # noqa: SIM115 - closed by finish
        self.members: dict[str, Member] = {}

    def add_file(self, name: str, path: Path) -> bool:
        """Adds the file as long as it is now, even while it grows. False if it is gone."""
        try:
            file = path.open("rb")
        except FileNotFoundError:
            return False
        with file:
            self._add(name, file, os.fstat(file.fileno()).st_size, int(path.stat().st_mtime))
        return True

    def add_bytes(self, name: str, content: bytes) -> None:
        self._add(name, io.BytesIO(content), len(content), 0)

    def _add(self, name: str, file: IO[bytes], size_bytes: int, changed_at: int) -> None:
        entry = tarfile.TarInfo(name)
        entry.size, entry.mode, entry.mtime = size_bytes, 0o600, changed_at
        hashing = _Hashing(file)
        self._tar.addfile(entry, hashing)
        self.members[name] = Member(size_bytes, hashing.hash.hexdigest())

    def finish(self, manifest: Manifest) -> int:
        """Returns the size of the archive in bytes."""
        content = msgspec.json.encode(manifest)
        self._add(MANIFEST, io.BytesIO(content), len(content), 0)
        self._tar.close()
        self._file.flush()
        os.fsync(self._file.fileno())
        size_bytes = self._file.tell()
        self._file.close()
        try:
            os.link(self._part, self._path)  # unlike a rename, never over another file
        except FileExistsError:
            raise BadArchive(f"{self._path} is there already: choose another name") from None
        return size_bytes

    def __enter__(self) -> ArchiveWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._file.close()
        self._part.unlink(missing_ok=True)


class ArchiveReader:
    """Reads a complete archive. Raises BadArchive for anything else."""

    def __init__(self, path: Path) -> None:
        try:
            self._tar = tarfile.open(path, "r:")  # noqa: SIM115 - closed by __exit__
        except FileNotFoundError:
            raise BadArchive(f"there is no file {path}") from None
        except (tarfile.TarError, EOFError) as error:
            raise BadArchive(f"{path} is no backup of a tower: {error}") from None
        self._path = path
        self._entries: dict[str, tarfile.TarInfo] = {}

    def check(self) -> Manifest:
        """Reads everything once and compares each checksum. Call it first."""
        sums: dict[str, Member] = {}
        try:
            for entry in self._tar:
                if not entry.isreg() or entry.name in self._entries:
                    raise BadArchive(f"{self._path} is damaged: {entry.name} should not be there")
                self._entries[entry.name] = entry
                if entry.name != MANIFEST:
                    sums[entry.name] = Member(entry.size, self._sum(entry))
            manifest = self._manifest()
        except (tarfile.TarError, EOFError, OSError, msgspec.MsgspecError) as error:
            raise BadArchive(f"{self._path} is damaged: {error}") from error
        if manifest.format != FORMAT:
            raise BadArchive(f"{self._path} has format {manifest.format}; this version reads {FORMAT}")
        for name in sorted(sums.keys() | manifest.members.keys()):
            if sums.get(name) != manifest.members.get(name):
                raise BadArchive(f"{self._path} is damaged: {name} is not what was written")
            if not _is_safe(name):
                raise BadArchive(f"{self._path} is damaged: {name} is no name of a file")
        missing = [name for name in manifest.tables if f"{DATABASE}{name}.jsonl.gz" not in manifest.members]
        if missing:
            raise BadArchive(f"{self._path} is damaged: the table {missing[0]} is missing")
        return manifest

    def open(self, name: str) -> IO[bytes]:
        found = self._tar.extractfile(self._entries[name])
        assert found is not None
        return found

    def read(self, name: str) -> bytes | None:
        """None if there is no such member."""
        return self.open(name).read() if name in self._entries else None

    def extract_files(self, folder: Path) -> int:
        """Writes all members below `files/` into the folder. Returns their number."""
        count = 0
        for name, entry in self._entries.items():
            if not name.startswith(FILES):
                continue
            path = folder / name.removeprefix(FILES)
            path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            with self.open(name) as source, path.open("wb") as out:
                while piece := source.read(_PIECE):
                    out.write(piece)
            os.utime(path, (entry.mtime, entry.mtime))
            count += 1
        return count

    def __enter__(self) -> ArchiveReader:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        with suppress(OSError):
            self._tar.close()

    def _manifest(self) -> Manifest:
        entry = self._entries.get(MANIFEST)
        if entry is None or entry.size > MAX_MANIFEST_BYTES:
            raise BadArchive(f"{self._path} is no complete backup: it has no list of its contents")
        content: Any = self.open(MANIFEST).read()
        return msgspec.json.decode(content, type=Manifest)

    def _sum(self, entry: tarfile.TarInfo) -> str:
        found = hashlib.sha256()
        source = self._tar.extractfile(entry)
        assert source is not None
        while piece := source.read(_PIECE):
            found.update(piece)
        return found.hexdigest()


def _is_safe(name: str) -> bool:
    """Whether it stays in the folder that it is written to."""
    path = PurePosixPath(name)
    known = name == KEYS or name.startswith((DATABASE, FILES))
    return known and not path.is_absolute() and ".." not in path.parts and "\0" not in name
