"""Bytes: no input may raise, and the same input at the same times gives the same output."""

from __future__ import annotations

import math

from hypothesis import example, given, settings
from hypothesis import strategies as st
from worlds.tiers import examples

from simulator.dialect import Codec, mavlink
from simulator.flight_state import FlightSettings
from simulator.geodesy import Place
from simulator.modes import Mode
from simulator.vehicle import INBOX_MAX, Vehicle, VehicleSettings

PLACE = Place(47.0, 8.0, 400.0)


def make(**flight: object) -> Vehicle:
    return Vehicle(VehicleSettings(FlightSettings(PLACE, boot_s=0.1, **flight)))  # type: ignore[arg-type]


@given(st.lists(st.binary(max_size=300), max_size=8))
@settings(max_examples=examples(20, long=120), deadline=None)
def test_random_bytes_never_raise_and_never_fly(chunks):
    vehicle = make()
    for number, chunk in enumerate(chunks):
        vehicle.receive(chunk, number * 0.01)
    vehicle.step(0.3)
    assert not vehicle.flight.armed


EVERY_MESSAGE = sorted(mavlink.mavlink_map)


@given(st.sampled_from(EVERY_MESSAGE), st.data())
@settings(max_examples=examples(50, long=300), deadline=None)
def test_every_message_with_random_fields_never_raises(number, data):
    """Well-formed frames, supported or not, with fields from the whole range of their types (NaN too)."""
    message_class = mavlink.mavlink_map[number]
    payload = data.draw(st.binary(min_size=message_class.unpacker.size, max_size=message_class.unpacker.size))
    send(vehicle := make(), number, payload)
    vehicle.step(0.5)


FLOATS = st.one_of(st.floats(width=32), st.sampled_from([0.0, 1.0, -1.0, math.nan, math.inf]))
HANDLED = sorted({16, 17, 20, 21, 22, 115, 176, 178, 179, 185, 192, 193, 224, 241, 246, 300, 400, 401, 410, 510, 511,
                  512, 519, 520})  # fmt: skip


@given(st.sampled_from(HANDLED), st.lists(FLOATS, min_size=7, max_size=7), st.booleans())
@settings(max_examples=examples(50, long=300), deadline=None)
@example(number=241, params=[0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0], as_int=False)
def test_commands_with_any_parameters_are_answered_once(number, params, as_int):
    vehicle, ears = make(), Codec(255)
    vehicle.step(0.2)
    vehicle.datagrams_to_send()
    if as_int:
        message = mavlink.MAVLink_command_int_message(1, 1, 3, number, 0, 0, *params[:4], 2**31 - 1, 5, params[6])
    else:
        message = mavlink.MAVLink_command_long_message(1, 1, number, 0, *params)
    vehicle.receive(Codec(255, 190).encode(message), 0.2)
    # A calibration is answered when it ends; one of the barometer says before that it has begun.
    vehicle.step(2.0 if number == mavlink.MAV_CMD_PREFLIGHT_CALIBRATION else 0.3)
    heard = [m for datagram in vehicle.datagrams_to_send() for m in ears.decode(datagram)]
    acks = [m for m in heard if m.get_type() == "COMMAND_ACK" and m.result != mavlink.MAV_RESULT_IN_PROGRESS]
    assert [m.command for m in acks] == [number]


def send(vehicle: Vehicle, number: int, payload: bytes) -> None:
    header = bytes([len(payload), 0, 0, 0, 255, 190]) + number.to_bytes(3, "little")
    crc = mavlink.x25crc(header + payload + bytes([mavlink.mavlink_map[number].crc_extra])).crc
    vehicle.receive(b"\xfd" + header + payload + crc.to_bytes(2, "little"), 0.2)


def flown(seed: int, step_s: float) -> bytes:
    """Returns all output of a short flight in gusts, with `step` called at another interval."""
    vehicle, codec = make(seed=seed, wind_mps=6.0, wind_from_deg=200.0), Codec(255, 190)

    def command(at_s: float, number: int, *params: float) -> None:
        seven = (*params, *([0.0] * (7 - len(params))))
        planned.append((at_s, codec.encode(mavlink.MAVLink_command_long_message(1, 1, number, 0, *seven))))

    planned: list[tuple[float, bytes]] = []
    for message_id in (30, 33, 74, 147):
        command(0.5, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 100_000)
    command(1.0, mavlink.MAV_CMD_DO_SET_MODE, 1, int(Mode.GUIDED))
    command(1.1, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    command(1.2, mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 5)
    sent, now_s = b"", 0.0
    while now_s < 6.0 - 1e-9:
        now_s = round(now_s + step_s, 6)
        while planned and planned[0][0] <= now_s:
            vehicle.receive(planned[0][1], planned.pop(0)[0])
        vehicle.step(now_s)
        sent += b"".join(vehicle.datagrams_to_send())
    assert vehicle.flight.body.alt_m > 2
    return sent


def test_same_seed_same_bytes_whatever_the_rhythm():
    assert flown(1, 0.005) == flown(1, 0.1)


def test_another_seed_another_wind():
    assert flown(1, 0.1) != flown(2, 0.1)


def test_sequence_numbers_have_no_gaps_and_frames_are_mavlink_2():
    vehicle = make()
    vehicle.step(5.0)
    datagrams = vehicle.datagrams_to_send()
    assert all(d[0] == 0xFD for d in datagrams)
    assert [d[4] for d in datagrams] == list(range(len(datagrams)))
    assert {(d[5], d[6]) for d in datagrams} == {(1, 1)}


def test_a_flood_is_bounded_and_counted():
    vehicle = make()
    for _ in range(INBOX_MAX + 10):
        vehicle.receive(b"x", 0.0)
    assert vehicle.overflowed == 10
    vehicle.step(1.0)


def test_frames_split_over_datagrams_and_mavlink_1_are_understood():
    vehicle = make()
    vehicle.step(0.5)  # the mode switch has been read
    codec = Codec(255, 190)
    frame = codec.encode(mavlink.MAVLink_set_mode_message(1, 1, int(Mode.LOITER)))
    vehicle.receive(b"\x00\x01garbage" + frame[:7], 0.5)
    vehicle.receive(frame[7:], 0.5)
    vehicle.step(0.55)
    assert vehicle.flight.mode is Mode.LOITER
    old = mavlink.MAVLink(None, 255, 190)
    vehicle.receive(bytes(mavlink.MAVLink_set_mode_message(1, 1, 2).pack(old, force_mavlink1=True)), 0.55)
    vehicle.step(0.6)
    assert vehicle.flight.mode is Mode.ALT_HOLD
