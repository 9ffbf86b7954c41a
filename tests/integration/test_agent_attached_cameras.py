"""Cameras behind a child process or RTSP: unplugged, missing, and how old a picture is."""

import contextlib
import socket
import sys
import threading
from pathlib import Path

import av
import pytest
from camera_world import DEADLINE_S, HEIGHT, WIDTH, Watched, next_taken
from worlds.moving_pictures import flight, off_by

from onboard_agent.video.encoders.choice import make_encoder
from onboard_agent.video.sources.schemes import make_source
from onboard_agent.video.sources.source import CameraLost, Picture, PictureRequest, now_us
from wire.video import CameraState, Codec, Quality

RPICAM = """#!{python}
import os, sys, time
words = sys.argv[1:]
of = lambda name: words[words.index(name) + 1]
size = int(of("--width")) * int(of("--height"))
assert of("--codec") == "yuv420" and of("--output") == "-" and of("--timeout") == "0", words
if not os.path.exists({plugged!r}):
    print("Preview window unavailable", file=sys.stderr)
    sys.exit("ERROR: *** no cameras available ***")
number = 0
while os.path.exists({plugged!r}):
    number += 1
    os.write(1, b"") or sys.stdout.buffer.write(bytes([number % 200 + 20]) * size + bytes([128]) * (size // 2))
    sys.stdout.flush()
    time.sleep(1 / float(of("--framerate")))
sys.exit("ERROR: Device timeout detected, attempting a restart!!!")
"""


@pytest.fixture
def plugged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file that represents the ribbon cable, and a fake camera program on the PATH."""
    cable = tmp_path / "plugged"
    cable.touch()
    program = tmp_path / "rpicam-vid"
    program.write_text(RPICAM.format(python=sys.executable, plugged=str(cable)))
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    return cable


def test_a_pi_camera_unplugged_and_back(plugged: Path) -> None:
    watched = Watched("pi:0?width=140&height=121&rate=40")
    first = watched.picture()
    assert (first.frame.width, first.frame.height, first.is_break) == (128, 120, True)
    luma = first.frame.to_ndarray()
    assert luma[:120].std() == 0
    assert (luma[120:] == 128).all()
    assert 0 <= now_us() - first.capture_us < 5_000_000
    plugged.unlink()
    watched.until(lambda: "ERROR: *** no cameras available ***" in watched.camera.words)
    assert watched.camera.state is CameraState.LOST
    while watched.camera.newest():
        pass
    plugged.touch()
    assert watched.picture().is_break
    assert watched.camera.stop()


def test_a_pi_without_its_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(CameraLost, match="rpicam-vid is not installed"):
        make_source("pi:0").open(PictureRequest())


class RtspCamera:
    """An RTSP server for one client: H.264 in RTP inside the RTSP connection. Sends each picture when the test says
    so."""

    def __init__(self, frames: list[av.VideoFrame]) -> None:
        self.frames, self.count, self.playing = frames, 0, threading.Event()
        self.encoder = make_encoder(Codec.H264, Quality.LOW)
        self.sequence = 0
        self.server = socket.create_server(("127.0.0.1", 0))
        self.address = f"rtsp://127.0.0.1:{self.server.getsockname()[1]}/main"
        self.thread = threading.Thread(target=self._talk, daemon=True)
        self.thread.start()

    def _talk(self) -> None:
        session = b"v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\ns=x\r\nt=0 0\r\nm=video 0 RTP/AVP 96\r\n"
        session += b"a=rtpmap:96 H264/90000\r\na=fmtp:96 packetization-mode=1\r\na=control:track0\r\n"
        answers = {
            b"OPTIONS": b"Public: DESCRIBE, SETUP, PLAY, TEARDOWN\r\n\r\n",
            b"DESCRIBE": b"Content-Type: application/sdp\r\nContent-Length: %d\r\n\r\n" % len(session) + session,
            b"SETUP": b"Transport: RTP/AVP/TCP;unicast;interleaved=0-1\r\nSession: 7\r\n\r\n",
            b"PLAY": b"Session: 7\r\n\r\n",
        }
        with contextlib.suppress(OSError):
            self.line, _ = self.server.accept()
            asked = self.line.makefile("rb")
            while request := asked.readline():
                number = b""
                while (line := asked.readline()) not in (b"\r\n", b""):
                    if line.lower().startswith(b"cseq:"):
                        number = line.strip()
                method = request.split()[0]
                self.line.sendall(b"RTSP/1.0 200 OK\r\n" + number + b"\r\n" + answers.get(method, b"\r\n"))
                if method == b"PLAY":
                    self.playing.set()

    def give(self) -> int:
        """Sends the next picture of `frames`. Returns the time of sending."""
        at_us = (self.count + 1) * 40_000
        picture = Picture(self.frames[self.count], at_us, self.count + 1, self.count == 0)
        (coded,) = self.encoder.encode(picture)
        self.count += 1
        units = [unit.rstrip(b"\0") for unit in coded.payload.split(b"\0\0\1") if unit.strip(b"\0")]
        sent_us = now_us()
        for unit in units:
            last = 0x80 if unit is units[-1] else 0
            self.sequence += 1
            packet = bytes([0x80, 96 | last]) + self.sequence.to_bytes(2) + (at_us * 9 // 100).to_bytes(4) + b"same"
            self.line.sendall(b"$\0" + (len(packet) + len(unit)).to_bytes(2) + packet + unit)
        return sent_us

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self.line.shutdown(socket.SHUT_RDWR)
        self.thread.join(DEADLINE_S)
        self.line.close()
        self.server.close()


def test_an_rtsp_picture_comes_with_the_next_one_and_that_counts_as_its_age() -> None:
    frames = flight(WIDTH, HEIGHT, 60)
    camera = RtspCamera(frames)
    source = make_source(camera.address)
    opening = threading.Thread(target=source.open, args=(PictureRequest(),), daemon=True)
    opening.start()
    assert camera.playing.wait(DEADLINE_S)
    while opening.is_alive():  # it probes a few pictures to detect the format
        camera.give()
        opening.join(0.04)
    for _ in range(camera.count - 1):
        next_taken(source.read)
    later_than_next_us = []
    for number in range(camera.count - 1, camera.count + 19):
        next_sent_us = camera.give()
        taken = next_taken(source.read)
        later_than_next_us.append(taken.capture_us - next_sent_us)
        off = [off_by(taken.frame, frames[other]) for other in (number - 1, number, number + 1)]
        assert min(off) == off[1]
    assert min(later_than_next_us) < 0  # not the time it was passed on
    source.close()
    camera.close()
