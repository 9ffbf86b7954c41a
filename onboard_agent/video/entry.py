"""Entry point of the video process: its standard input and output, its log, its end."""

import asyncio
import contextlib
import ctypes
import logging
import os
import signal
import sys
from collections.abc import Callable
from typing import Final

from onboard_agent.link.tower_url import parse_tower_url
from onboard_agent.video.core.lines import MAX_LINE_BYTES, BadLine, Report, SetUp, decode_to_child, encode_line
from onboard_agent.video.encoders.choice import make_encoder, usable_codecs
from onboard_agent.video.process import CameraThread, Parts, VideoProcess
from onboard_agent.video.sources.camera import Camera
from onboard_agent.video.sources.schemes import make_source
from onboard_agent.video.sources.source import PictureRequest

_log = logging.getLogger("onboard_agent")

_PR_SET_PDEATHSIG: Final = 1
LET_GO_WITHIN_S: Final = 1.5


def main() -> None:
    """Does not return: ends the process."""
    _die_with_parent()
    out = os.dup(1)
    os.dup2(2, 1)  # output of libraries must not reach the flight process as lines
    os.set_blocking(out, False)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the flight process, which ends this one
    asyncio.run(_run(out))
    os._exit(0)  # a thread that hangs in a camera driver must not block the exit


def _die_with_parent() -> None:
    """Ends this process with its parent, because closing standard input does not end a stopped or hanging process."""
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


async def _run(out: int) -> None:
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader(limit=MAX_LINE_BYTES)
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    try:
        set_up = decode_to_child(await reader.readline())
    except BadLine:
        return
    if not isinstance(set_up, SetUp):
        return
    _set_up_logging(set_up.log_level)

    def make_camera(request: PictureRequest, on_change: Callable[[], None]) -> CameraThread:
        return Camera(make_source(set_up.camera), request, on_change)

    def say(report: Report) -> None:
        with contextlib.suppress(BlockingIOError, BrokenPipeError):  # the next report repeats it
            os.write(out, encode_line(report))

    process = VideoProcess(
        Parts(make_camera, make_encoder, usable_codecs),
        None if set_up.trial else parse_tower_url(set_up.tower),
        set_up.uplinks,
        say,
        set_up.link,
    )
    running = asyncio.create_task(process.run())
    listening = asyncio.create_task(_listen(reader, process))
    done, _ = await asyncio.wait({running, listening}, return_when=asyncio.FIRST_COMPLETED)
    for task in done:
        if task.exception() is not None:
            _log.error("video: %r", task.exception())
            os._exit(1)
    running.cancel()
    with contextlib.suppress(asyncio.CancelledError, TimeoutError):
        async with asyncio.timeout(LET_GO_WITHIN_S):
            await running
            await loop.shutdown_default_executor()


async def _listen(reader: asyncio.StreamReader, process: VideoProcess) -> None:
    """Reads messages until the flight process closes the pipe."""
    while line := await reader.readline():
        message = decode_to_child(line)
        if isinstance(message, SetUp):
            raise BadLine("set up twice")
        process.watched(message)


def _set_up_logging(level: str) -> None:
    form = "%(levelname)s %(message)s" if os.environ.get("JOURNAL_STREAM") else "%(asctime)s %(levelname)s %(message)s"
    logging.basicConfig(stream=sys.stderr, level=logging.WARNING, format=form)
    _log.setLevel(level.upper())
