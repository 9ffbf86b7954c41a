"""Camera addresses: their forms, the faults of a bad one, and a check that loads nothing."""

import subprocess
import sys

import pytest

from onboard_agent.unusable import Unusable
from onboard_agent.video.sources.http_camera import HttpCamera
from onboard_agent.video.sources.looped_file import LoopedFile
from onboard_agent.video.sources.mode import Mode
from onboard_agent.video.sources.network import NetworkSource
from onboard_agent.video.sources.pi import PiSource
from onboard_agent.video.sources.realsense import RealsenseSource
from onboard_agent.video.sources.schemes import FORMS, check_spec, help_text, make_source, parse_spec, shown
from onboard_agent.video.sources.v4l2 import V4l2Source


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("v4l2:/dev/video0", V4l2Source),
        ("v4l2:/dev/v4l/by-id/usb-A:B?width=640&height=480&rate=30", V4l2Source),
        ("pi:0", PiSource),
        ("pi:1?rate=24", PiSource),
        ("realsense:colour", RealsenseSource),
        ("realsense:aligned:817412070163?width=848&height=480&rate=30", RealsenseSource),
        ("realsense:depth:/data/hover.db3", RealsenseSource),
        ("file:flights/one two.mp4", LoopedFile),
        ("rtsp://10.0.0.2:8554/main", NetworkSource),
        ("http://127.0.0.1:8090/camera", HttpCamera),
        ("https://camera.example/mjpeg", HttpCamera),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_source_of_each_kind(text: str, kind: type) -> None:
    source = make_source(f" {text} ")
    assert type(source) is kind
    assert source.name == text
    assert text.partition(":")[0] in help_text()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no known kind"),
        ("webcam", "no known kind"),
        ("v4l2:", "expected /dev/video0"),
        ("v4l2:/dev/video0?width=640", "width and height go together"),
        ("v4l2:/dev/video0?width=0&height=0", "width is to be a whole number from 1 to 8192"),
        ("v4l2:/dev/video0?width=8000&height=8000", "8000 x 8000 pixels are too large, the most is 9.4 million"),
        ("v4l2:/dev/video0?rate=fast", "rate is to be a whole number from 1 to 240"),
        ("v4l2:/dev/video0?colour=red", "'colour' is not known; known: width, height, rate"),
        ("v4l2:/dev/video0?nonsense", "width=W"),
        ("pi:", "expected the camera's number"),
        ("pi:front", "expected the camera's number"),
        ("file:", "expected a path"),
        ("realsense:", "expected STREAM[:SERIAL|:FILE]"),
        ("realsense:gyro", "colour, infrared, infrared2, depth, aligned"),
        ("realsense:depth:front", "digits, or a recording"),
        ("realsense:depth?rate=0", "rate is to be a whole number"),
        ("rtsp:camera", "expected //HOST"),
        ("http://:80/", "expected //HOST"),
        ("http://camera:port/", "expected //HOST"),
        ("http://camera/a b", "%20"),
        ("http://camera/\u00e9", "%20"),
        ("http://[::1/", "expected //HOST"),
    ],
)
def test_what_is_wrong_is_said(text: str, words: str) -> None:
    with pytest.raises(Unusable) as found:
        check_spec(text)
    assert words in str(found.value)


def test_the_unknown_are_told_what_is_known() -> None:
    with pytest.raises(Unusable) as found:
        check_spec("usb:0")
    assert FORMS in str(found.value)


def test_a_mode() -> None:
    spec = parse_spec("v4l2:/dev/video2?width=1280&height=720&rate=60")
    assert (spec.what, spec.mode) == ("/dev/video2", Mode(1280, 720, 60))


@pytest.mark.parametrize(
    ("text", "without"),
    [
        ("rtsp://admin:s3cret@10.0.0.2/main", "rtsp://...@10.0.0.2/main"),
        ("http://admin:p%40ss@camera:8080/a?b=s3cret", "http://...@camera:8080/a?..."),
        ("http://camera/video.cgi?user=admin&pwd=s3cret", "http://camera/video.cgi?..."),
        ("http://camera/video.cgi?user=a@b&pwd=s3cret", "http://...@..."),
        ("rtsp://10.0.0.2:554/user=admin_password=s3cret_channel=1.sdp", "rtsp://10.0.0.2:554/..."),
        ("v4l2:/dev/video0", "v4l2:/dev/video0"),
    ],
)
def test_no_password_is_shown(text: str, without: str) -> None:
    assert shown(text) == without
    assert make_source(text).name == without


@pytest.mark.parametrize(
    "text",
    [
        "http://user:s3cret@[::1/",
        "rtsp://admin:s3cret/more@10.0.0.2/main",
        "rtsp://admin:s3cret?more@10.0.0.2/main",
        "http://admin:s3cret#more@camera/",
        "http://camera/with space?pwd=s3cret",
        "ftp://admin:s3cret@camera/",
        "rtsp:admin:s3cret@camera",
    ],
)
def test_no_password_is_told_with_what_is_wrong(text: str) -> None:
    with pytest.raises(Unusable) as found:
        check_spec(text)
    assert "s3cret" not in str(found.value)


def test_checking_loads_no_picture_library() -> None:
    """The flight process checks them: the libraries take a second and 60 MB."""
    check = "import onboard_agent.video.sources.schemes as s, sys; s.check_spec('pi:0'); s.help_text(); "
    check += "sys.exit(bool({'av', 'cv2', 'numpy'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", check], timeout=30, check=False).returncode == 0
