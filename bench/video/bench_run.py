"""Runs the requested cases of `bench video`. See docs/bench.md."""

from __future__ import annotations

import argparse
import contextlib
import shutil
import tempfile
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Final

from bench.namespaces import why_not
from bench.peers.environment import CannotInstall
from bench.peers.jsmpeg import Jsmpeg, jsmpeg_in
from bench.rows import Report
from bench.video.delay import delays, for_long
from bench.video.fan_out import fan_out
from bench.video.screens import our_page_built
from bench.video.settings import H264, LARGE, LINES, SMALL
from bench.video.sticks import sticks
from bench.video.throttle import throttle
from bench.video.trial import OURS, PEER, Bench

SECONDS: Final = 30.0
ROUNDS: Final = 3
MINUTES: Final = 10.0
QUICK_SECONDS: Final = 6.0


async def _loopback(bench: Bench) -> None:
    for setting in (SMALL, LARGE):
        await delays(bench, f"{setting.words}, loopback", setting)


async def _h264(bench: Bench) -> None:
    await delays(bench, f"{H264.words}, loopback", H264)


async def _drone_lines(bench: Bench) -> None:
    for line in LINES:
        await delays(bench, f"{SMALL.words}, drone by {line.words}", SMALL, {"drone": line})


async def _viewer_lines(bench: Bench) -> None:
    for line in LINES:
        await delays(bench, f"{SMALL.words}, viewer by {line.words}", SMALL, {"browser": line})


CASES: Final[dict[str, Callable[[Bench], Awaitable[None]]]] = {
    "loopback": _loopback,
    "h264": _h264,
    "drone-lines": _drone_lines,
    "viewer-lines": _viewer_lines,
    "fanout": fan_out,
    "throttle": throttle,
    "sticks": sticks,
}
ON_A_NETWORK: Final = frozenset({"drone-lines", "viewer-lines", "throttle", "sticks"})
LONG: Final = "long"


def chosen(words: str | None) -> list[str]:
    """Returns the cases in a comma-separated list; all but the long one if the list is empty. Raises ValueError."""
    names = words.split(",") if words else list(CASES)
    for name in names:
        if name not in CASES and name != LONG:
            raise ValueError(f"no case {name!r}; there are {', '.join([*CASES, LONG])}")
    return names


async def run(report: Report, options: argparse.Namespace) -> None:
    """`--cases`, `--case`, `--rounds`, `--seconds`, `--minutes`, `--system`, `--peers`, `--keep`, `--quick`."""
    names = chosen(options.cases)
    systems = options.system or [OURS, PEER]
    jsmpeg = await _peer(report, options.peers.resolve()) if PEER in systems else None
    if (missing := why_not()) is not None and ON_A_NETWORK & set(names):
        report.say(f"no emulated network: this needs {missing}")
        names = [name for name in names if name not in ON_A_NETWORK]
    with _folder(options.keep) as folder:
        page = await our_page_built(folder) if OURS in systems else folder
        seconds = options.seconds or (QUICK_SECONDS if options.quick else SECONDS)
        rounds = options.rounds or (1 if options.quick else ROUNDS)
        bench = Bench(report, folder, jsmpeg, OURS in systems, page, seconds, rounds, tuple(options.case or ()))
        for name in names:
            if name == LONG:
                await for_long(bench, f"{SMALL.words}, {options.minutes:g} minutes", SMALL, options.minutes)
            else:
                await CASES[name](bench)


async def _peer(report: Report, folder: Path) -> Jsmpeg | None:
    try:
        return await jsmpeg_in(folder)
    except CannotInstall as reason:
        report.say(f"without JSMpeg: {reason}")
        return None


@contextlib.contextmanager
def _folder(keep: Path | None) -> Iterator[Path]:
    folder = Path(tempfile.mkdtemp(prefix="bench-video-")) if keep is None else keep
    folder.mkdir(parents=True, exist_ok=True)
    try:
        yield folder.resolve()
    finally:
        if keep is None:
            shutil.rmtree(folder, ignore_errors=True)
