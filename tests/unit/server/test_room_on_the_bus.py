"""State for visitors waits while the bus takes no more, and goes on by itself when it does."""

from __future__ import annotations

from typing import Any

from server.towers.api.nats_bus import HIGH_WATER_BYTES
from server.towers.api.several_towers import _Room, _VisitorWriter


class Bus:
    full = False

    def has_room(self) -> bool:
        return not self.full


class Towers:
    def __init__(self) -> None:
        self.sent: list[Any] = []

    def send(self, tower: str, message: Any) -> None:
        self.sent.append(message)


class Visitor:
    tower, remote = "ab" * 16, 7


def writer_in(bus: Any) -> tuple[_VisitorWriter, _Room, list[str]]:
    room = _Room(bus)
    visitor: Any = Visitor()
    towers: Any = Towers()
    writer, told = _VisitorWriter(visitor, towers, room), list[str]()
    writer.on_room = lambda: told.append("room")
    return writer, room, told


def test_what_is_not_flushed_yet_takes_room() -> None:
    writer, room, told = writer_in(Bus())
    writer.write_text(bytes(HIGH_WATER_BYTES - 1))
    assert writer.has_room()
    writer.write_binary(b"!")
    assert not writer.has_room()
    room.tick()
    assert told == []
    room.unflushed_bytes = 0  # as the flush does
    room.tick()
    assert told == ["room"]


def test_a_bus_that_was_full_between_two_ticks_leaves_nobody_waiting() -> None:
    bus = Bus()
    writer, room, told = writer_in(bus)
    bus.full = True
    assert not writer.has_room()
    bus.full = False
    room.tick()
    room.tick()
    assert told == ["room"]


def test_a_visitor_who_left_is_not_told() -> None:
    bus = Bus()
    writer, room, told = writer_in(bus)
    bus.full = True
    assert not writer.has_room()
    room.left(writer)
    bus.full = False
    room.tick()
    assert told == []
