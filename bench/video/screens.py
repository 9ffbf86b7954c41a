"""A headless Chromium whose canvases are read back: on this machine, or on a host of the emulated network."""

from __future__ import annotations

import asyncio
import contextlib
import shlex
import shutil
import time
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

from playwright.async_api import Browser, BrowserContext, Page, Route, async_playwright

from bench.peers.jsmpeg import CANVAS, PAGE, CommandAt, Jsmpeg
from bench.rig import PASSWORD
from bench.video.settings import CODEC_WORDS, Setting
from bench.video.strip import Screen

READER: Final = (Path(__file__).resolve().parent / "strip_reader.js").read_text().split("\n", 3)[3]
CHROMIUM_NAMES: Final = ("chromium", "chromium-browser", "google-chrome")
FLAGS: Final = (
    "--no-sandbox",
    "--disable-gpu",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-features=LocalNetworkAccessChecks",  # the peer's page may have another origin than its relay
)
FIRST_PICTURE_S: Final = 30.0
OUR_CANVAS: Final = "[data-testid=video-picture]"
OUR_DELAY: Final = "[data-testid=video-delay]"
CONSOLE: Final = Path(__file__).resolve().parent.parent.parent / "web"
PAGE_PATH: Final = "/bench-video/"
PEERS_ORIGIN: Final = "http://jsmpeg.bench"


class NothingSeen(Exception):
    """No picture reached the screen."""


def chromium_program() -> str | None:
    return next((path for name in CHROMIUM_NAMES if (path := shutil.which(name))), None)


@contextlib.asynccontextmanager
async def chromium(folder: Path, name: str, command_at: CommandAt) -> AsyncIterator[Browser]:
    """`name`: of its start script, unique. `command_at`: see bench.peers.jsmpeg."""
    program = chromium_program()
    if program is None:
        raise RuntimeError("this needs Chromium (Debian: apt-get install chromium)")
    script = folder / f"chromium-{name}"
    # Run by root, Chromium gives its compositor priority over everything on the machine; for a user it does not.
    modest = ["setpriv", "--bounding-set=-sys_nice"] if shutil.which("setpriv") else []
    script.write_text(f'#!/bin/sh\nexec {shlex.join(command_at(*modest, program))} "$@"\n')
    script.chmod(0o700)
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=script, args=list(FLAGS))
        try:
            yield browser
        finally:
            await browser.close()


@dataclass
class Shown:
    """A page with a canvas that is read. `screen` has what was seen until the last `collect`."""

    page: Page
    screen: Screen
    looks: int = 0
    longest_gap_ms: float = 0.0
    reported_ms: list[float] = field(default_factory=list)
    """The delay that our page itself reports, at each collection."""

    async def watch(self, canvas: str) -> None:
        """Reads this canvas (a CSS selector) from now on. Raises NothingSeen."""
        await self.page.evaluate(READER, canvas)
        deadline = time.monotonic() + FIRST_PICTURE_S
        while not self.screen.sights:
            if time.monotonic() > deadline:
                raise NothingSeen(f"{self.screen.misread} readings were no strip; {await self.words()}")
            await asyncio.sleep(0.1)
            await self.collect()

    async def collect(self) -> None:
        readings, self.looks, self.longest_gap_ms = await self.page.evaluate(
            "() => { const r = window.stripReader; const gap = r.longestGapMs; r.longestGapMs = 0;"
            " return [r.readings.splice(0), r.looks, gap]; }"
        )
        self.screen.take((at, cells) for at, cells in readings)
        reported = await self.page.evaluate("where => document.querySelector(where)?.dataset.value", OUR_DELAY)
        if reported:
            self.reported_ms.append(float(reported))

    async def words(self) -> str:
        """Returns the beginning of the page's text, for errors."""
        return " ".join((await self.page.inner_text("body")).split())[:300]


@contextlib.asynccontextmanager
async def peers_page(browser: Browser, jsmpeg: Jsmpeg, url: str, size: tuple[int, int]) -> AsyncIterator[Shown]:
    """The player as documented, on `url` of the relay."""
    context = await browser.new_context()
    try:
        page = await _page(context, lambda said: None)
        words = PAGE.format(width=size[0], height=size[1], url=url)

        async def serve(route: Route) -> None:
            if route.request.url.endswith("jsmpeg.js"):
                await route.fulfill(path=jsmpeg.player, content_type="text/javascript")
            else:
                await route.fulfill(body=words, content_type="text/html")

        await page.route(f"{PEERS_ORIGIN}/**", serve)
        await page.goto(f"{PEERS_ORIGIN}/")
        shown = Shown(page, Screen())
        await shown.watch(CANVAS)
        yield shown
    finally:
        await context.close()


async def our_page_built(folder: Path) -> Path:
    """Builds the console's video alone as a page (web/bench/video_page) into `folder`. Raises RuntimeError."""
    built = folder / "page"
    words = ("vite", "build", "bench/video_page", "--config", "vite.config.ts", "--outDir", str(built))
    process = await asyncio.create_subprocess_exec(
        *("npx", "--no-install", *words, "--emptyOutDir", "--logLevel", "warn"),
        cwd=CONSOLE,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
    )
    said, _ = await process.communicate()
    if process.returncode:
        raise RuntimeError(f"the page of the video cannot be built (make setup): {said.decode()[-500:]}")
    return built


@contextlib.asynccontextmanager
async def our_page(browser: Browser, built: Path, address: str, setting: Setting) -> AsyncIterator[Shown]:
    """The video of drone 1 for the operator, from the tower at `address`."""
    context = await browser.new_context(ignore_https_errors=True)
    complaints: list[str] = []
    try:
        answer = await context.request.post(
            f"{address}/api/v1/session", data={"name": "operator", "password": PASSWORD}, headers={"Origin": address}
        )
        assert answer.ok, await answer.text()

        async def serve(route: Route) -> None:
            file = built / (urlsplit(route.request.url).path.removeprefix(PAGE_PATH) or "index.html")
            await route.fulfill(path=file, content_type=_CONTENT_TYPES.get(file.suffix, "text/plain"))

        await context.route(f"{address}{PAGE_PATH}**", serve)
        page = await _page(context, complaints.append)
        asked = f"drone=1&quality={setting.quality.name.lower()}&codec={CODEC_WORDS[setting.codec]}"
        await page.goto(f"{address}{PAGE_PATH}?{asked}&width={setting.width}&height={setting.height}")
        await page.wait_for_selector(OUR_CANVAS)
        shown = Shown(page, Screen())
        try:
            await shown.watch(OUR_CANVAS)
        except NothingSeen as nothing:
            raise NothingSeen(f"{nothing} {complaints[:3]}") from None
        yield shown
    finally:
        await context.close()


_CONTENT_TYPES: Final = {
    ".html": "text/html",
    ".js": "text/javascript",
    ".css": "text/css",
    ".wasm": "application/wasm",
}


async def _page(context: BrowserContext, complain: Callable[[str], None]) -> Page:
    page = await context.new_page()
    page.on("pageerror", lambda error: complain(str(error)))
    return page
