"""What two towers tell each other goes in packets that the bus takes, whatever waits."""

from __future__ import annotations

from server.towers.core.messages import (
    MAX_BODY_BYTES,
    EventUp,
    decode_messages,
    encode_bodies,
    encode_packet,
    read_header,
)

TOWER = "ab" * 16


def test_little_goes_in_one_packet() -> None:
    told = [EventUp(1, b"one"), EventUp(2, b"two")]
    bodies = list(encode_bodies(list(told)))
    assert len(bodies) == 1
    header = read_header(encode_packet(TOWER, 3, 4, 5, bodies[0]))
    assert (header.sender, header.stream, header.sequence, header.sent_ms) == (TOWER, 3, 4, 5)
    assert decode_messages(header.body) == told


def test_the_picture_of_a_thousand_drones_is_split_in_order() -> None:
    told = [EventUp(1, b"%04d" % number + bytes(1_000)) for number in range(1_500)]
    bodies = list(encode_bodies(list(told)))
    assert max(map(len, bodies)) <= MAX_BODY_BYTES
    assert [one for body in bodies for one in decode_messages(body)] == told


def test_one_large_message_stays_whole() -> None:
    large = EventUp(1, bytes(3 * MAX_BODY_BYTES))
    bodies = list(encode_bodies([EventUp(1, b"before"), large, EventUp(1, b"after")]))
    told = [one for body in bodies for one in decode_messages(body)]
    assert told == [EventUp(1, b"before"), large, EventUp(1, b"after")]
