"""The cost of each profile, measured on the simulator's output for the agent's requests.

Bytes a second on the wire, with sealing, UDP and IP headers and the keep-alive.
"""

import pytest

from onboard_agent.autopilot.rates import RATE_REQUESTS
from onboard_agent.telemetry.thinner import Thinner
from simulator.dialect import Codec
from simulator.flight_state import FlightSettings
from simulator.geodesy import Place
from simulator.vehicle import Vehicle, VehicleSettings
from wire.dialect import mavlink
from wire.frames import message_id
from wire.ids import DroneId, Epoch, LinkId
from wire.sealed_link import SealedLink
from wire.stream_profiles import StreamProfile

UDP_AND_IP_BYTES = 28
TICK_S = 0.025
MEASURED_S = 60
EVERYTHING_HZ = 10
"""The rate that an eager ground station requests for each stream."""

FULL, THIN, MINIMAL = StreamProfile.FULL, StreamProfile.THIN, StreamProfile.MINIMAL


class Way:
    """A simulated drone, the thinner, and a sealed link that counts its datagrams. The tower answers each ping."""

    def __init__(self, profile: StreamProfile, *, by_hand: bool, eager: bool) -> None:
        self.vehicle = Vehicle(VehicleSettings(FlightSettings(Place(47.39, 8.54, 488.0), boot_s=0.5)))
        codec = Codec(255, 190)
        if eager:
            self.vehicle.receive(
                codec.encode(mavlink.MAVLink_request_data_stream_message(1, 1, 0, EVERYTHING_HZ, 1)), 0.0
            )
        else:
            for request in RATE_REQUESTS:
                if request.rate_hz:
                    message = mavlink.MAVLink_command_long_message(
                        1, 1, 511, 0, request.message_id, 1e6 / request.rate_hz, 0, 0, 0, 0, 0
                    )
                    self.vehicle.receive(codec.encode(message), 0.0)
        self.thinner = Thinner()
        self.thinner.profile, self.thinner.by_hand = profile, by_hand
        self.agent, self.tower = _link(b"a" * 32, b"t" * 32), _link(b"t" * 32, b"a" * 32)
        self.bytes_up = 0
        self.kinds: set[int] = set()

    def run(self, seconds: float) -> float:
        """Returns bytes a second, excluding the first two seconds."""
        ticks = round((seconds + 2) / TICK_S)
        for tick in range(1, ticks + 1):
            now = tick * TICK_S
            if now <= 2:
                self.bytes_up = 0
            self.vehicle.step(now)
            # The simulator sends its frames tick by tick, and so in fewer datagrams than a real autopilot would in
            # full.
            frames = self.thinner.admit(self.vehicle.datagrams_to_send()) + self.thinner.due(now)
            self.kinds |= {message_id(frame) for frame in frames}
            if frames:
                self._up(self.agent.seal_frames(Epoch(1), frames, now), now)
            self._up(self.agent.datagrams_to_send(now), now)
            for datagram in self.tower.datagrams_to_send(now):
                self.agent.receive(datagram, now)
        return self.bytes_up / seconds

    def _up(self, datagrams: list[bytes], now: float) -> None:
        for datagram in datagrams:
            self.bytes_up += len(datagram) + UDP_AND_IP_BYTES
            self.tower.receive(datagram, now)


def _link(send: bytes, receive: bytes) -> SealedLink:
    return SealedLink(link_id=LinkId(1), drone_id=DroneId(1), send_key=send, receive_key=receive, now=0.0)


@pytest.mark.parametrize(
    ("profile", "by_hand", "eager", "least", "most"),
    [
        (FULL, False, False, 1500, 2600),
        (THIN, False, False, 600, 1100),
        (MINIMAL, False, False, 300, 600),
        (THIN, True, False, 900, 1500),
        (MINIMAL, True, False, 800, 1500),
        (FULL, False, True, 5000, 9000),
        (THIN, False, True, 600, 1100),
        (MINIMAL, False, True, 300, 600),
    ],
)
def test_what_a_profile_costs(profile: StreamProfile, by_hand: bool, eager: bool, least: int, most: int) -> None:
    """The figures of docs/agent.md. A thin stream stays thin, whatever the autopilot is made to send."""
    assert least < Way(profile, by_hand=by_hand, eager=eager).run(MEASURED_S) < most


def test_minimal_leaves_nothing_out_altogether() -> None:
    full, minimal = (Way(profile, by_hand=False, eager=True) for profile in (FULL, MINIMAL))
    full.run(MEASURED_S)
    minimal.run(MEASURED_S)
    assert minimal.kinds == full.kinds
