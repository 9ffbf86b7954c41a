"""Credentials, the agreement on keys, and the typed messages of the control channel."""

import json

import msgspec
import pytest
from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey
from hypothesis import given
from hypothesis import strategies as st

from wire.control_messages import (
    AutopilotState,
    ControlChanged,
    Hello,
    HoldOrder,
    HoldProgress,
    HoldStep,
    MalformedMessage,
    ToAgent,
    ToTower,
    Welcome,
    decode_to_agent,
    decode_to_tower,
    encode_message,
)
from wire.credential import Credential, MalformedCredential, parse_credential
from wire.ids import DroneId, LinkId
from wire.key_agreement import BadPublicKey, agree, public_bytes

SALT = b"z" * 32
LINK = LinkId(77)


def test_both_sides_get_the_same_keys_and_each_direction_its_own() -> None:
    agent, tower = X25519PrivateKey.generate(), X25519PrivateKey.generate()
    at_agent = agree(agent, public_bytes(tower), salt=SALT, link_id=LINK)
    at_tower = agree(tower, public_bytes(agent), salt=SALT, link_id=LINK)
    assert at_agent == at_tower
    assert at_agent.agent_to_tower != at_agent.tower_to_agent
    assert {len(key) for key in at_agent} == {32}


def test_another_sign_in_or_link_makes_other_keys() -> None:
    agent, tower = X25519PrivateKey.generate(), X25519PrivateKey.generate()
    keys = {
        agree(agent, public_bytes(tower), salt=salt, link_id=link_id)
        for salt in (SALT, b"y" * 32)
        for link_id in (LINK, LinkId(78))
    }
    assert len(keys) == 4


@pytest.mark.parametrize(
    "key",
    [b"", b"x" * 31, b"x" * 33, bytes(32), b"\x01" + bytes(31)],
    ids=["empty", "short", "long", "zero", "low order"],
)
def test_a_bad_public_key_is_refused(key: bytes) -> None:
    with pytest.raises(BadPublicKey):
        agree(X25519PrivateKey.generate(), key, salt=SALT, link_id=LINK)


SECRET = "A-b_" * 10 + "xyz"


def test_a_credential_reads_as_it_is_written() -> None:
    credential = parse_credential(f"  twd_12_{SECRET}\n")
    assert credential == Credential(DroneId(12), SECRET)
    assert str(credential) == f"twd_12_{SECRET}"
    assert SECRET not in repr(credential)
    assert len(credential.hashed()) == 64


BAD_CREDENTIALS = [
    "",
    "twd_12",
    f"twd_0_{SECRET}",
    f"twd_01_{SECRET}",
    f"twd_12_{SECRET}x",
    f"twd_12_{SECRET[:-1]}",
    f"twd_-1_{SECRET}",
    f"TWD_12_{SECRET}",
    f"twd_12_{SECRET[:-1]}!",
    f"twd_12_{SECRET} twd_13_{SECRET}",
]


@pytest.mark.parametrize("text", BAD_CREDENTIALS)
def test_a_bad_credential_is_refused_and_not_repeated(text: str) -> None:
    with pytest.raises(MalformedCredential) as caught:
        parse_credential(text)
    assert SECRET not in str(caught.value)


TO_TOWER: list[ToTower] = [
    Hello(agent_version="0.2.0", public_key=b"\0\xff" * 16),
    HoldProgress(order_id=3, epoch=4, step=HoldStep.CONFIRMED, detail='ALT_HOLD "2"', elapsed_ms=41.5),
    AutopilotState(heard=True, armed=False, airborne=False),
]
TO_AGENT: list[ToAgent] = [
    Welcome(drone_id=7, name="kestrel", link_id=2**32 - 1, public_key=b"k" * 32, udp_port=14650, epoch=0, holder=None),
    ControlChanged(epoch=5, holder="ada", holder_present=True),
    HoldOrder(order_id=3, epoch=4, reason="taken by an admin"),
]


@pytest.mark.parametrize("message", TO_TOWER, ids=lambda m: type(m).__name__)
def test_messages_to_the_tower_round_trip(message: ToTower) -> None:
    assert decode_to_tower(encode_message(message)) == message


@pytest.mark.parametrize("message", TO_AGENT, ids=lambda m: type(m).__name__)
def test_messages_to_the_agent_round_trip(message: ToAgent) -> None:
    assert decode_to_agent(encode_message(message)) == message


def test_a_message_on_the_wire_is_as_documented() -> None:
    assert json.loads(encode_message(TO_AGENT[2])) == {
        "type": "hold_order",
        "order_id": 3,
        "epoch": 4,
        "reason": "taken by an admin",
        "interrupts": True,
    }


def test_unknown_fields_are_ignored() -> None:
    text = '{"type": "control_changed", "epoch": 1, "holder": null, "holder_present": false, "mood": "good"}'
    assert decode_to_agent(text) == ControlChanged(epoch=1, holder=None, holder_present=False)


MALFORMED = [
    "",
    "{}",
    "[]",
    "null",
    '{"type": "hold_order"}',
    '{"type": "no such type"}',
    '{"type": "hold_order", "order_id": -1, "epoch": 4, "reason": ""}',
    '{"type": "hold_order", "order_id": 1, "epoch": 4294967296, "reason": ""}',
    '{"type": "hold_order", "order_id": 1, "epoch": "4", "reason": ""}',
    '{"type": "hold_progress", "order_id": 1, "epoch": 4, "step": "dancing", "detail": "", "elapsed_ms": 1}',
]


@pytest.mark.parametrize("text", MALFORMED)
def test_malformed_messages_are_refused(text: str) -> None:
    with pytest.raises(MalformedMessage):
        decode_to_agent(text)
    with pytest.raises(MalformedMessage):
        decode_to_tower(text)


@pytest.mark.parametrize("port", [0, -1, 65536])
def test_a_welcome_with_an_impossible_port_is_refused(port: int) -> None:
    welcome = msgspec.structs.replace(TO_AGENT[0], udp_port=port)  # type: ignore[type-var]
    with pytest.raises(MalformedMessage):
        decode_to_agent(encode_message(welcome))


@given(st.text())
def test_random_text_raises_nothing_else(text: str) -> None:
    for decode in (decode_to_agent, decode_to_tower):
        with pytest.raises(MalformedMessage):
            decode(text)


json_values = st.recursive(st.none() | st.booleans() | st.integers() | st.floats() | st.text(), st.lists, max_leaves=3)


@given(
    st.sampled_from(["hello", "welcome", "control_changed", "hold_order", "hold_progress", "autopilot_state"]),
    st.dictionaries(
        st.sampled_from(["epoch", "holder", "holder_present", "order_id", "reason", "public_key", "protocol", "step"]),
        json_values,
    ),
)
def test_random_fields_raise_nothing_else(kind: str, fields: dict[str, object]) -> None:
    text = json.dumps({"type": kind, **fields})
    for decode in (decode_to_agent, decode_to_tower):
        try:
            message = decode(text)
        except MalformedMessage:
            continue
        assert getattr(message, "epoch", 0) in range(2**32)


def test_the_final_steps_of_a_hold() -> None:
    assert {step for step in HoldStep if step.final} == {HoldStep.CONFIRMED, HoldStep.NOT_NEEDED, HoldStep.UNCONFIRMED}


@pytest.mark.parametrize(
    "text",
    [
        b'{"type":"hold_progress","more":' + b"[" * 1390,
        b'{"type":"hold_order","more":' + b'{"a":' * 5000,
        b'{"type":"\xff\xfe"}',
        b'{"type":"hold_progress","detail":"\xc3"}',
        b'{"type":"hold_order","reason":"\xc3"}',
        b"\x00",
    ],
    ids=["nested as deep as a datagram allows", "nested deeper", "no UTF-8 type", "cut UTF-8", "cut UTF-8 down", "nul"],
)
def test_what_no_json_reader_takes_is_a_malformed_message(text: bytes) -> None:
    """Urgent messages arrive as unchecked bytes in a datagram."""
    for decode in (decode_to_tower, decode_to_agent):
        with pytest.raises(MalformedMessage):
            decode(text)
