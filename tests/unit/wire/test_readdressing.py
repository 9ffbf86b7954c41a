"""Frames under another system id keep everything else."""

from hypothesis import given
from hypothesis import strategies as st

from wire.dialect import build, decode, mavlink
from wire.frame_signing import is_signed, sign
from wire.frames import MAGIC_V2, checksum_holds, payload, source
from wire.own_system import target_system
from wire.readdressing import readdressed

systems = st.integers(1, 254)


def command(target: int, sender: int = 255) -> bytes:
    message = mavlink.MAVLink_command_long_message(target, 1, 400, 0, 1, 0, 0, 0, 0, 0, 7.5)
    return build(message, system_id=sender, component_id=190, sequence=9)


@given(sender=systems, new_sender=systems, target=systems, new_target=systems)
def test_only_the_systems_change(sender: int, new_sender: int, target: int, new_target: int) -> None:
    frame = command(target, sender)
    assert readdressed(frame, sender=new_sender, target=new_target) == command(new_target, new_sender)
    assert readdressed(frame) == frame


@given(sender=systems)
def test_what_has_no_addressee_gets_none(sender: int) -> None:
    beat = build(mavlink.MAVLink_heartbeat_message(2, 3, 81, 0, 3, 3), system_id=1, component_id=1, sequence=0)
    changed = readdressed(beat, sender=sender, target=77)
    assert source(changed) == (sender, 1) and checksum_holds(changed)
    assert payload(changed) == payload(beat)


def test_a_frame_to_all_stays_one() -> None:
    """Trailing zeros are left out on the wire: there is no byte to write to."""
    everybody = build(mavlink.MAVLink_param_request_list_message(0, 0), system_id=255, component_id=190, sequence=0)
    changed = readdressed(everybody, target=0)
    assert target_system(changed) == 0 and checksum_holds(changed)


def test_a_signature_goes() -> None:
    signed = sign(command(1), bytes(32), link_id=1, ticks=5)
    changed = readdressed(signed, target=2)
    assert not is_signed(changed)
    assert changed == command(2)


@given(body=st.binary(min_size=1, max_size=200), sender=systems, seed=st.integers(0, 255))
def test_a_message_that_nobody_here_knows_keeps_a_checksum_that_holds(body: bytes, sender: int, seed: int) -> None:
    from fastcrc.crc16 import mcrf4xx

    def unknown(system: int) -> bytes:
        head = bytes((MAGIC_V2, len(body), 0, 0, 3, system, 1, 0x12, 0x34, 0x05))
        return head + body + mcrf4xx(head[1:] + body + bytes((seed,))).to_bytes(2, "little")

    assert decode(unknown(1)) is None
    assert readdressed(unknown(1), sender=sender) == unknown(sender)
