"""The console as an installed app: what makes it installable, opening without a tower, updates to a new version."""

import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from console_page import FLAGS, ConsolePage
from playwright.sync_api import BrowserContext, expect, sync_playwright
from worlds.processes import World, kill_9


@pytest.fixture(scope="module")
def profiles(modest_chromium: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[BrowserContext]:
    """A browser profile on disk, because a private window cannot install anything."""
    expect.set_options(timeout=20_000)
    with sync_playwright() as playwright:
        context = playwright.chromium.launch_persistent_context(
            tmp_path_factory.mktemp("profile"),
            executable_path=modest_chromium,
            args=list(FLAGS),
            viewport={"width": 1280, "height": 800},
        )
        yield context
        context.close()


@pytest.fixture
def visitor(profiles: BrowserContext, quiet_world: World) -> Iterator[ConsolePage]:
    """A browser on the sign-in page that has cached the console. Each test's tower has its own port, and so an origin
    with its own caches and workers.
    """
    profiles.clear_cookies()
    console = ConsolePage(profiles.new_page(), quiet_world.address)
    console.open()
    expect(console.part("sign-in-button")).to_be_visible()
    wait_until_kept(console)
    yield console
    console.page.close()


def wait_until_kept(console: ConsolePage) -> None:
    console.page.evaluate("navigator.serviceWorker.ready.then((it) => it.active.state)")
    console.page.wait_for_function("() => navigator.serviceWorker.controller")


def kept_addresses(console: ConsolePage) -> list[str]:
    """Returns everything that the browser caches for the console, without the tower's address."""
    kept = console.page.evaluate(
        """async () => {
          const names = await caches.keys();
          const requests = await Promise.all(names.map(async (name) => (await caches.open(name)).keys()));
          return requests.flat().map((one) => new URL(one.url).pathname);
        }"""
    )
    return [str(one) for one in kept]


def test_a_browser_finds_nothing_in_the_way_of_installing_it(visitor: ConsolePage) -> None:
    session = visitor.page.context.new_cdp_session(visitor.page)
    said = session.send("Page.getAppManifest")
    assert said["errors"] == []
    manifest = json.loads(said["data"])
    assert manifest["display"] == "standalone"
    assert {one["purpose"] for one in manifest["icons"]} == {"any", "maskable"}
    assert session.send("Page.getInstallabilityErrors")["installabilityErrors"] == []
    assert [said for said in visitor.complaints if "401" not in said] == []


def test_without_a_tower_it_opens_and_says_so_and_goes_on_when_the_tower_is_back(
    visitor: ConsolePage, quiet_world: World
) -> None:
    visitor.sign_in("alice")
    expect(visitor.part("squad-row")).to_have_count(1)
    kill_9(quiet_world.tower)
    visitor.page.reload()
    expect(visitor.part("no-connection")).to_contain_text("No connection to the tower")
    # A page of the console at another path is the console as well.
    visitor.open("/#/drone/1")
    expect(visitor.part("no-connection")).to_contain_text("Next try in")
    kept = kept_addresses(visitor)
    assert any(path.startswith("/assets/") for path in kept)
    assert any(path.startswith("/basemap/") for path in kept)
    assert [path for path in kept if path.startswith(("/api", "/metrics"))] == []
    quiet_world.start_tower()
    # The session is still valid, so she gets to her page without a click.
    expect(visitor.part("connection-state")).to_contain_text("Connected")
    expect(visitor.page).to_have_title("Kestrel - Control Tower")


NEXT = "-next.js"


def newer_build(built: Path, folder: Path) -> Path:
    """Makes the next version of the console: other file names, and none of the old ones left."""
    shutil.copytree(built, folder)
    for copy in [*folder.rglob("*.br"), *folder.rglob("*.gz")]:
        copy.unlink()
    # A file's name depends on its content, and so on the names of all files that it loads.
    scripts = [script.name for script in folder.glob("assets/*.js")]
    name = re.compile("|".join(re.escape(one) for one in scripts))
    for file in [*folder.glob("*.html"), folder / "sw.js", *folder.glob("assets/*.js")]:
        file.write_text(name.sub(lambda found: found[0].replace(".js", NEXT), file.read_text()))
    for script in scripts:
        (folder / "assets" / script).rename(folder / "assets" / script.replace(".js", NEXT))
    worker = (folder / "sw.js").read_text()
    (version,) = set(re.findall(r"`([0-9a-f]{16})`", worker))
    (folder / "sw.js").write_text(worker.replace(version, "0123456789abcdef"))
    return folder


def test_a_new_version_is_told_and_loaded_only_when_asked_for(
    visitor: ConsolePage, quiet_world: World, console: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    visitor.sign_in("alice")
    expect(visitor.part("squad-row")).to_have_count(1)
    visitor.page.evaluate("window.stillTheSamePage = true")
    monkeypatch.setenv("TOWER_WEB", str(newer_build(console.parent, tmp_path / "newer")))
    kill_9(quiet_world.tower)
    quiet_world.start_tower()
    expect(visitor.part("new-version")).to_be_visible()
    # The page goes on with its loaded parts, which the tower no longer has.
    visitor.open("/#/account")
    expect(visitor.page.get_by_role("heading", name="Password", exact=True)).to_be_visible()
    assert visitor.page.evaluate("window.stillTheSamePage")
    assert NEXT not in visitor.page.content()
    visitor.part("new-version").click()
    visitor.page.wait_for_function("() => window.stillTheSamePage === undefined")
    expect(visitor.part("connection-state")).to_contain_text("Connected")
    assert NEXT in visitor.page.content()
    expect(visitor.part("new-version")).to_have_count(0)
