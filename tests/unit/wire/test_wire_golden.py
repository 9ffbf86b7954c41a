"""The formats, byte by byte, against committed hexadecimal and against an independent copy of the layout."""

import hashlib
import hmac
import struct
from pathlib import Path

from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey
from cryptography.hazmat.primitives.ciphers.aead import ChaCha20Poly1305

from wire.content import Frames, Ping, Pong, Purpose, Report, decode_content, encode_frames, encode_keepalive
from wire.dialect import build, mavlink
from wire.ids import DroneId, Epoch, LinkId
from wire.key_agreement import agree_by_credential, public_bytes
from wire.sealing import Opener, Sealer
from wire.tagged import join, split_tagged, tag

KEY = bytes(range(32))
LINK = LinkId(0xA1B2C3D4)
HEARTBEAT = build(mavlink.MAVLink_heartbeat_message(2, 3, 81, 5, 4, 3), system_id=1, component_id=1, sequence=7)
ATTITUDE = build(
    mavlink.MAVLink_attitude_message(1000, 0.5, -0.25, 1.0, 0, 0, 0), system_id=1, component_id=1, sequence=8
)
PING = Ping(1, Report(7, 6), trip_us=40_000, lost=51)
PROBE = Ping(1 << 31, Report(7, 6), Purpose.UPLINK, uplink=3, padding_bytes=4)
PONG = Pong(1, Report(9, 9))


def golden(name: str) -> bytes:
    return bytes.fromhex((Path(__file__).parent / "golden" / f"{name}.hex").read_text())


def test_frames_are_as_they_were() -> None:
    assert golden("heartbeat_frame") == HEARTBEAT
    assert golden("attitude_frame") == ATTITUDE


def test_tagged_frames() -> None:
    message = join([tag(DroneId(1), HEARTBEAT), tag(DroneId(0x01020304), ATTITUDE)])
    assert message == golden("tagged_frames")
    assert message == b"\x01\0\0\0" + HEARTBEAT + b"\x04\x03\x02\x01" + ATTITUDE
    assert split_tagged(message) == [(1, HEARTBEAT), (0x01020304, ATTITUDE)]


def test_sealed_datagrams() -> None:
    sealer = Sealer(KEY, LINK)
    (content,) = encode_frames(DroneId(7), Epoch(3), 5000, [HEARTBEAT, ATTITUDE])
    assert sealer.seal(content) == golden("sealed_frames")
    assert sealer.seal(encode_keepalive(PING)) == golden("sealed_keepalive_ping")
    assert sealer.seal(encode_keepalive(PROBE)) == golden("sealed_uplink_ping")
    assert sealer.seal(encode_keepalive(PONG)) == golden("sealed_keepalive_pong")
    (content,) = encode_frames(DroneId(7), Epoch(3), 5000, [ATTITUDE], ping=PING)
    assert sealer.seal(content) == golden("sealed_ping_and_frames")


def test_keepalives_by_the_written_layout_alone() -> None:
    assert encode_keepalive(PING) == struct.pack("<BIQQBBIB", 7, 1, 7, 6, 0, 0, 40_000, 51)
    assert encode_keepalive(PROBE) == struct.pack("<BIQQBBIB", 7, 1 << 31, 7, 6, 2, 3, 0, 0) + bytes(4)
    assert encode_keepalive(PONG) == struct.pack("<BIQQ", 8, 1, 9, 9)
    (along,) = encode_frames(DroneId(7), Epoch(3), 5000, [HEARTBEAT], ping=PING)
    assert along[:28] == b"\x09" + encode_keepalive(PING)[1:]
    assert [along[28:]] == encode_frames(DroneId(7), Epoch(3), 5000, [HEARTBEAT])


def test_a_golden_datagram_opens_by_the_written_layout_alone() -> None:
    datagram = golden("sealed_frames")
    assert datagram[:14] == struct.pack("<BBIQ", 1, 0, LINK, 0)
    content = ChaCha20Poly1305(KEY).decrypt(bytes(4) + datagram[6:14], datagram[14:], datagram[:14])
    assert content == struct.pack("<BIII", 1, 7, 3, 5000) + HEARTBEAT + ATTITUDE


def test_golden_datagrams_open() -> None:
    opener = Opener(KEY, LINK)
    names = ("frames", "keepalive_ping", "uplink_ping", "keepalive_pong", "ping_and_frames")
    contents = [decode_content(opener.open(golden(f"sealed_{name}"))) for name in names]
    frames = Frames(DroneId(7), Epoch(3), 5000, [HEARTBEAT, ATTITUDE])
    assert contents == [frames, PING, PROBE, PONG, frames._replace(frames=[ATTITUDE], ping=PING)]


def test_link_keys_are_hkdf_sha256_as_written() -> None:
    agent, tower = (X25519PrivateKey.from_private_bytes(bytes([n]) * 32) for n in (0x11, 0x22))
    keys = agree_by_credential(agent, public_bytes(tower), credential_hash="ab" * 32, link_id=LinkId(5))
    assert keys.agent_to_tower + keys.tower_to_agent == golden("link_keys")
    extracted = hmac.digest(b"\xab" * 32, agent.exchange(tower.public_key()), hashlib.sha256)
    information = b"tower data v1" + (5).to_bytes(4, "little")
    first = hmac.digest(extracted, information + b"\x01", hashlib.sha256)
    second = hmac.digest(extracted, first + information + b"\x02", hashlib.sha256)
    third = hmac.digest(extracted, second + information + b"\x03", hashlib.sha256)
    assert keys == (first, second, third)
