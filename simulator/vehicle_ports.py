"""Serial ports of a vehicle beside MAVLink: MSP with its sticks and switches, and a receiver on an SBUS line.

Bytes in, bytes out, time passed in. A port outlives a reboot of its vehicle. It is the vehicle's receiver: while its
sticks are missing, the transmitter is lost, and the autopilot's own radio failsafe acts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import IntEnum
from typing import Final, Protocol

from simulator.flight import Flight
from simulator.serial_inputs.boxes import ANGLE, ARM, BOXES, FAILSAFE, FLYING, HEIGHT, MISSION, POSITION, RETURN, Box
from simulator.serial_inputs.msp_server import MspServer, Snapshot
from simulator.serial_inputs.radio import SbusRadio
from simulator.vehicle import Vehicle

MAX_WAITING = 4096
"""Bytes until the next step, a third of a second at 115,200 baud; in a flood the newest are lost."""
SILENT_AFTER_S = 0.5
CENTRE_SUM_US = 3000
PULSES_US = (800, 2200)
AUX_AT_REST: Final = (1000, 1000, 1000, 1000)
SATELLITES = 10

_MODES: Mapping[Box, tuple[str, ...]] = {
    RETURN: ("RTL",),
    MISSION: ("AUTO", "MISSION"),
    POSITION: ("POSCTL", "LOITER"),
    HEIGHT: ("ALT_HOLD", "ALTCTL"),
    ANGLE: ("STABILIZE", "STABILIZED"),
}
"""The mode of each box, on ArduCopter or PX4: the first that there is."""


class VehiclePort(Protocol):
    def receive(self, data: bytes) -> None:
        """Only queues."""

    def step(self, now_s: float) -> bytes:
        """Called before each step of the vehicle, with its time. Returns what goes out."""


class _Waiting:
    def __init__(self) -> None:
        self._data = bytearray()
        self.lost_bytes = 0

    def add(self, data: bytes) -> None:
        room = MAX_WAITING - len(self._data)
        self._data += data[:room]
        self.lost_bytes += max(len(data) - room, 0)

    def take(self) -> bytes:
        data = bytes(self._data)
        self._data.clear()
        return data


class SbusPort:
    """Only listens. All sixteen channels are the receiver's, so the fifth is ArduCopter's mode switch."""

    def __init__(self, vehicle: Vehicle) -> None:
        self._vehicle = vehicle
        self._waiting = _Waiting()
        self.radio = SbusRadio()

    def receive(self, data: bytes) -> None:
        self._waiting.add(data)

    def step(self, now_s: float) -> bytes:
        flight = self._vehicle.flight
        self.radio.receive(self._waiting.take(), now_s)
        heard = self.radio.ok(now_s)
        flight.transmitter_lost = not heard
        if heard:
            pulses = self.radio.sticks_us()
            flight.sticks.radio_pwm[: len(pulses)] = pulses
        return b""


class MspPort:
    """Until the first MSP_SET_RAW_RC it only tells; from then on it is the receiver."""

    def __init__(self, vehicle: Vehicle) -> None:
        self._vehicle = vehicle
        self._waiting = _Waiting()
        self._server = MspServer(self.snapshot, self._take, BOXES)
        self._now_s = 0.0
        self._heard_s: float | None = None
        self._aux_us: tuple[int, ...] = AUX_AT_REST
        self._modes = {box: _mode_of(vehicle, box) for box in FLYING}

    def receive(self, data: bytes) -> None:
        self._waiting.add(data)

    def step(self, now_s: float) -> bytes:
        self._now_s = now_s
        answers = self._server.receive(self._waiting.take())
        if self._heard_s is not None:
            self._vehicle.flight.transmitter_lost = now_s - self._heard_s > SILENT_AFTER_S
        return answers

    def _take(self, pulses: tuple[int, ...]) -> None:
        """Roll, pitch, throttle, yaw (AETR), switches. Forward is up here, and down on ArduCopter and PX4."""
        if len(pulses) < 4:
            return
        flight, (low, high) = self._vehicle.flight, PULSES_US
        roll, pitch, throttle, yaw, *aux = (min(max(pulse, low), high) for pulse in pulses)
        self._heard_s = self._now_s
        flight.sticks.radio_pwm[:4] = (roll, CENTRE_SUM_US - pitch, throttle, yaw)
        before, self._aux_us = self._aux_us, tuple(aux)
        self._switch(flight, before)

    def _switch(self, flight: Flight, before: tuple[int, ...]) -> None:
        """Acts when a switch moves, and not on where it stands."""
        box = next((box for box in FLYING if box.moved_by(self._aux_us)), None)
        if box is not None and not box.moved_by(before):
            flight.set_mode(self._modes[box])
        if ARM.moved_by(self._aux_us) and not ARM.moved_by(before):
            flight.arm()
        elif ARM.moved_by(before) and not ARM.moved_by(self._aux_us):
            flight.disarm()

    def snapshot(self) -> Snapshot:
        flight = self._vehicle.flight
        body, battery = flight.body, flight.battery
        roll, pitch, yaw = (math.degrees(angle) for angle in body.attitude())
        place = flight.known_place
        radio = flight.sticks.pwm
        return Snapshot(
            name=self._vehicle.settings.flavour.name,
            armed=flight.armed,
            acceleration_mss=body.force_body_mss,
            rates_dps=(math.degrees(body.p_rps), math.degrees(body.q_rps), math.degrees(body.r_rps)),
            roll_deg=roll,
            pitch_deg=pitch,
            yaw_deg=yaw,
            alt_m=flight.alt_over_home_m(),
            climb_mps=-body.vd_mps,
            lat_deg=place.lat_deg if place else 0.0,
            lon_deg=place.lon_deg if place else 0.0,
            alt_amsl_m=place.alt_amsl_m if place else 0.0,
            ground_speed_mps=body.ground_speed_mps(),
            course_deg=math.degrees(math.atan2(body.ve_mps, body.vn_mps)),
            satellites=SATELLITES if flight.estimator.gps_fix else 0,
            fix=flight.estimator.position_ok,
            voltage_v=battery.voltage_v,
            current_a=battery.current_a,
            used_mah=battery.used_mah,
            motors=flight.commands,
            sticks_us=(radio[0], CENTRE_SUM_US - radio[1], radio[3], radio[2], *self._aux_us),
            active=self._active(flight),
        )

    def _active(self, flight: Flight) -> frozenset[Box]:
        active = {box for box, mode in self._modes.items() if flight.mode is mode}
        if flight.armed:
            active.add(ARM)
        if flight.failsafes.radio:
            active.add(FAILSAFE)
        return frozenset(active)


def _mode_of(vehicle: Vehicle, box: Box) -> IntEnum:
    by_name = {mode.name: mode for mode in vehicle.settings.flavour.rules}
    return next(by_name[name] for name in _MODES[box] if name in by_name)
