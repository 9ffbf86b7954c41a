"""Reads the vehicle's own metadata of its parameters by MAVLink FTP and passes it to the tower. No I/O.

Rules, each tested:
- COMPONENT_METADATA is requested once AUTOPILOT_VERSION has arrived and announces MAVLink FTP. A refusal or a silence
  is final until the autopilot comes again.
- Nothing waits for metadata: the service works only while the drone is disarmed and the autopilot has no other work.
  Other work aborts the file in progress; the file is read from its beginning when the autopilot is idle again.
- It reads only files of this autopilot, bounded in size and time, and unpacks a small part at each tick. A damaged file
  is read again; a file that is no metadata is not.
- A file with a known CRC is not read again.
- The tower receives the hash on each link and after each change, and the bytes on request, piece by piece, while the
  drone is disarmed.
"""

from collections.abc import Callable, Iterator
from typing import Any, Final

from onboard_agent.autopilot.own_frames import FrameMaker, Sender, request_message
from onboard_agent.transactions.file_frames import FileFrames, read_answer
from onboard_agent.transactions.file_read import FileRead
from onboard_agent.transactions.handler import Around
from onboard_agent.transactions.metadata_general import (
    MetadataDamaged,
    MetadataUnusable,
    OfferedFile,
    general_file,
    parameters_file,
)
from onboard_agent.transactions.metadata_unpacking import MAX_GENERAL_BYTES, Steps, packed_parameters, unpacked
from wire.dialect import COMPONENT_METADATA, decode, mavlink
from wire.frames import message_id, source
from wire.parameter_metadata import MAX_PIECE_BYTES, MetadataKnown, MetadataPiece, metadata_hash
from wire.transactions import Transaction, TransactionToTower

COMPONENT: Final = mavlink.MAV_COMP_ID_ONBOARD_COMPUTER4
"""Component id of the requests, so that answers are not mistaken for answers to flight-related requests."""
ASK_AFTER_S: Final = 1.0
"""After AUTOPILOT_VERSION. The parameters have priority."""
ASK_TRIES: Final = 3
ANSWER_WITHIN_S: Final = 1.0
FILE_TRIES: Final = 3
FILE_AGAIN_S: Final = 10.0
FILE_WITHIN_S: Final = 120.0
REST_S: Final = 2.0
"""Required idle time of the autopilot before the service continues."""
BLOCK_ANSWER_S: Final = 1.5
PIECE_EVERY_S: Final = 0.5

_NOT_YET: Final = "The vehicle has not been asked for it yet."
_WAITS: Final = (mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_IN_PROGRESS, mavlink.MAV_RESULT_TEMPORARILY_REJECTED)


class MetadataService:
    """A TransactionHandler. `parameters_busy`: whether parameters are being read or written at that time."""

    works: tuple[type, ...] = ()
    hears = frozenset(
        {
            mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
            mavlink.MAVLINK_MSG_ID_COMMAND_ACK,
            mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL,
            COMPONENT_METADATA,
        }
    )

    def __init__(self, maker: FrameMaker, *, parameters_busy: Callable[[float], bool]) -> None:
        self._maker = maker
        self._parameters_busy = parameters_busy
        self._autopilot: tuple[int, int] | None = None
        """System id and kind."""
        self._ask_at: float | None = None
        self._asked = 0
        self._general: OfferedFile | None = None
        """The file to read, as is `_parameters`; None: not known, or done."""
        self._parameters: OfferedFile | None = None
        self._read: FileRead | None = None
        self._read_until = 0.0
        self._read_at = 0.0
        self._failures = 0
        self._left_open: FileRead | None = None
        """An ended or abandoned reading whose session must be closed."""
        self._unpacking: Steps | None = None
        self._busy_at = float("-inf")
        self._known_file: OfferedFile | None = None
        """The source file of `_packed`."""
        self._packed = b""
        self._known = MetadataKnown(hash=None, words=_NOT_YET)
        self._pieces: Iterator[MetadataPiece] = iter(())
        self._piece_at = float("-inf")
        self._reports: list[TransactionToTower] = [self._known]

    # TransactionHandler.

    def autopilot_came(self, around: Around, now: float) -> None:
        """Starts again. Metadata of the same autopilot stays valid until the autopilot reports otherwise."""
        if self._autopilot != (around.system_id, around.autopilot_kind):
            self._autopilot = (around.system_id, around.autopilot_kind)
            self._known_file = None
            self._report(b"", _NOT_YET)
        self._ask_at, self._asked = None, 0
        self._begin(None)

    def begin(self, transaction: Transaction, around: Around | None, now: float) -> None:
        """Does nothing: the service has no `works`."""

    def cancel(self, transaction_id: int, now: float) -> None:
        """Does nothing: the service has no `works`."""

    def epoch_changed(self, epoch: int, now: float) -> None:
        """Does nothing: the service writes nothing."""

    def receive(self, frame: bytes, now: float) -> bool:
        """Takes a frame of a type in `hears`."""
        if self._autopilot is None or source(frame) != (self._autopilot[0], 1):
            return False
        kind = message_id(frame)
        if kind == COMPONENT_METADATA:
            self._named(frame)
            return False
        message = decode(frame)
        if message is None:
            return False
        if kind == mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
            self._version(message, now)
        elif kind == mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL:
            answer = read_answer(message, self._autopilot[0], COMPONENT)
            if answer is not None and self._read is not None:
                self._read.receive(answer, now)
            return answer is not None
        else:
            return self._acknowledged(message)
        return False

    def due(self, around: Around, now: float) -> list[bytes]:
        """Frames to send to the autopilot now."""
        self._send_piece(around, now)
        if self._in_the_way(around, now):
            self._busy_at = now
            self._stop()
        out: list[bytes] = []
        if self._left_open is not None:
            out = self._left_open.due(now)
            self._left_open = None
        if now - self._busy_at < REST_S:
            return out
        if self._unpacking is not None:
            self._unpack(self._unpacking, now)
        elif self._general is not None or self._parameters is not None:
            out += self._read_on(around, now)
        else:
            out += self._ask(around, now)
        return out

    def reports(self) -> list[TransactionToTower]:
        """Returns the messages for the tower once, in order."""
        reports, self._reports = self._reports, []
        return reports

    def resend(self) -> None:
        """The tower may know nothing: sends the hash again, and the tower then requests what it lacks."""
        self._pieces = iter(())
        self._reports = [self._known]

    # The tower.

    def wanted(self, hash_: str) -> None:
        """Queues the pieces of the metadata with this hash, which the tower lacks."""
        if hash_ == self._known.hash:
            whole = self._packed
            self._pieces = (
                MetadataPiece(hash=hash_, offset=at, data=whole[at : at + MAX_PIECE_BYTES])
                for at in range(0, len(whole), MAX_PIECE_BYTES)
            )

    # Internals.

    def _in_the_way(self, around: Around, now: float) -> bool:
        flies = around.armed or around.holding or around.starting
        return flies or not around.heard or around.busy or self._parameters_busy(now)

    def _version(self, version: Any, now: float) -> None:
        if not version.capabilities & mavlink.MAV_PROTOCOL_CAPABILITY_FTP:
            self._none("has no MAVLink FTP")
        elif self._ask_at is None:
            self._ask_at = now + ASK_AFTER_S

    def _ask(self, around: Around, now: float) -> list[bytes]:
        if self._ask_at is None or now < self._ask_at:
            return []
        if self._asked >= ASK_TRIES:
            self._none("does not answer when it is asked for it")
            return []
        self._asked += 1
        self._ask_at = now + ANSWER_WITHIN_S
        ask = request_message(around.system_id, COMPONENT_METADATA, confirmation=self._asked - 1)
        return [self._maker.make(ask, Sender(around.system_id, COMPONENT))]

    @property
    def _asks(self) -> bool:
        return self._asked > 0 and self._ask_at is not None and self._ask_at < float("inf")

    def _acknowledged(self, ack: Any) -> bool:
        assert self._autopilot is not None
        ours = (ack.target_system, ack.target_component) == (self._autopilot[0], COMPONENT)
        if not ours or not self._asks or ack.command != mavlink.MAV_CMD_REQUEST_MESSAGE:
            return False
        if ack.result not in _WAITS:
            self._none("offers none")
        return True

    def _named(self, frame: bytes) -> None:
        """Takes COMPONENT_METADATA, whoever requested it, but only after our own request."""
        if not self._asks:
            return
        self._ask_at = float("inf")
        offered = general_file(frame)
        if offered is None:
            self._none("names a general file of metadata that is not on board: it is not fetched")
        else:
            self._begin(offered)

    def _begin(self, general: OfferedFile | None) -> None:
        self._general, self._parameters = general, None
        self._failures, self._read_at = 0, 0.0
        self._stop()

    def _stop(self) -> None:
        """Aborts reading and unpacking. Both start again later; the abort does not count as a failure."""
        self._unpacking = None
        if self._read is not None:
            self._read.give_up()
            self._left_open, self._read = self._read, None

    def _read_on(self, around: Around, now: float) -> list[bytes]:
        offered = self._general or self._parameters
        assert offered is not None
        if self._read is None:
            if now < self._read_at:
                return []
            talk = FileFrames(self._maker, vehicle_system_id=around.system_id, component=COMPONENT)
            at_once = 1 if around.narrow_line else 2
            self._read = FileRead(talk, offered.path, at_once=at_once, answer_s=BLOCK_ANSWER_S)
            self._read_until = now + FILE_WITHIN_S
        if now >= self._read_until:
            self._read.give_up()
        out = self._read.due(now)
        end, why_not = self._read.end, self._read.why_not
        if end is None and why_not is None:
            return out
        self._left_open, self._read = self._read, None
        if end is None:
            self._failed(f"has a file of metadata that could not be read: {why_not}", now)
        elif self._general is not None:
            self._unpacking = unpacked(end, offered.crc, max_bytes=MAX_GENERAL_BYTES)
        else:
            self._unpacking = packed_parameters(end, offered.crc)
        return out

    def _failed(self, why: str, now: float) -> None:
        self._failures += 1
        self._read_at = now + FILE_AGAIN_S
        if self._failures >= FILE_TRIES:
            self._none(why)

    def _unpack(self, steps: Steps, now: float) -> None:
        """Runs one step of the unpacking."""
        try:
            data = _next(steps)
            if data is not None:
                self._unpacking = None
                self._unpacked(data)
        except MetadataDamaged as damaged:
            self._unpacking = None
            self._failed(str(damaged), now)
        except MetadataUnusable as unusable:
            self._none(str(unusable))

    def _unpacked(self, data: bytes) -> None:
        """Takes the text of the general file, or the packed parameters for the tower. Raises MetadataUnusable."""
        if self._general is None:
            self._known_file, self._parameters = self._parameters, None
            self._report(data, "")
            return
        offered = parameters_file(data)
        self._begin(None)
        if offered.crc is None or offered != self._known_file:
            self._parameters = offered

    def _none(self, why: str) -> None:
        self._ask_at = float("inf")
        self._begin(None)
        self._known_file = None
        self._report(b"", f"The vehicle {why}."[:300])

    def _report(self, data: bytes, words: str) -> None:
        known = MetadataKnown(hash=metadata_hash(data) if data else None, size_bytes=len(data), words=words)
        if known != self._known:
            self._packed, self._known = data, known
            self._pieces = iter(())
            self._reports.append(known)

    def _send_piece(self, around: Around, now: float) -> None:
        if around.armed or now < self._piece_at:
            return
        piece = next(self._pieces, None)
        if piece is not None:
            self._piece_at = now + PIECE_EVERY_S
            self._reports.append(piece)


def _next(steps: Steps) -> bytes | None:
    """Runs one step. Returns the result, or None if more steps remain."""
    try:
        next(steps)
    except StopIteration as ended:
        return bytes(ended.value)
    return None
