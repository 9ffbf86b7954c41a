"""The vehicle's files for MAVLink FTP beside the parameters: component metadata, and the logs in their directory."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import UTC, datetime

from simulator.dialect import Message
from simulator.file_protocol import FileServer
from simulator.flavour import Flavour
from simulator.logbook import Logbook
from simulator.metadata import ComponentFiles
from simulator.parameters import Parameters

ARDUPILOT_LOGS = "/APM/LOGS"
PX4_LOGS = "/fs/microsd/log"


class ServedFiles:
    """ArduPilot numbers its logs in one directory; PX4 has a directory for each day."""

    def __init__(self, logbook: Logbook, metadata: ComponentFiles | None, *, by_day: bool) -> None:
        self._logbook = logbook
        self._metadata = metadata
        self._by_day = by_day

    def file(self, name: bytes) -> bytes | None:
        """Returns the content; None: there is no such file."""
        for path, data in self._logs():
            if path == name:
                return bytes(data)
        return None if self._metadata is None else self._metadata.file(name)

    def entries(self, directory: bytes) -> Sequence[bytes] | None:
        """Returns the entries as MAVLink FTP writes them, without the zeros after each; None: no such directory."""
        inside = directory.rstrip(b"/") + b"/"
        root = (PX4_LOGS if self._by_day else ARDUPILOT_LOGS).encode() + b"/"
        found: dict[bytes, None] = {}
        for path, data in self._logs():
            if path.startswith(inside):
                name, slash, _ = path[len(inside) :].partition(b"/")
                found[b"D" + name if slash else b"F%s\t%d" % (name, len(data))] = None
        return (b"D.", b"D..", *found) if found or inside == root else None

    def _logs(self) -> list[tuple[bytes, bytearray]]:
        found = []
        for number, log in enumerate(self._logbook.logs, 1):
            begun = datetime.fromtimestamp(log.begun_unix_s, UTC)
            by_day = f"{PX4_LOGS}/{begun:%Y-%m-%d}/{begun:%H_%M_%S}.ulg"
            path = by_day if self._by_day else f"{ARDUPILOT_LOGS}/{number:08}.BIN"
            found.append((path.encode(), log.data))
        return found


def file_server(
    parameters: Parameters,
    send: Callable[[Message], None],
    logbook: Logbook,
    metadata: ComponentFiles | None,
    flavour: Flavour,
) -> FileServer:
    """Returns the server of one vehicle."""
    packs = flavour.keeps_parameter_file
    served = ServedFiles(logbook, metadata, by_day=not packs)
    return FileServer(parameters, send, packs_parameters=packs, file=served.file, entries=served.entries)
