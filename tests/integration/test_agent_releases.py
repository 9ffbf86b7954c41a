"""The folder of an agent's releases, and the trial of one: real files, real processes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from worlds.agent_releases import payload
from worlds.processes import CHECKOUT

from onboard_agent import VERSION
from onboard_agent.update.releases import NotInstalled, Releases
from wire.transactions import Outcome

LAUNCH = """
import sys
from pathlib import Path
from onboard_agent.update import launch
launch.TRIAL_S = 1.0
launch._START = "from onboard_agent.cli import main; main()"
launch.launch(launch.Releases(Path(sys.argv[1])))
print("the installed agent runs")
"""
HANGS = {"onboard_agent/cli.py": "import time\ndef main():\n    print('hangs', flush=True)\n    time.sleep(60)\n"}
LINKS = {
    "onboard_agent/cli.py": """
import os, sys
def main():
    if os.environ.get("TOWER_AGENT_TRIAL"):
        from onboard_agent.systemd import Systemd
        Systemd().linked()
        sys.exit(75)
    print("runs as", os.environ["TOWER_AGENT_RELEASE"])
"""
}


def install(releases: Releases, version: str, files: dict[str, str] | None = None) -> None:
    releases.incoming.write_bytes(b"a head\n" + payload(version, files))
    releases.install(version, releases.incoming)


def launch(folder: Path) -> str:
    environment = {name: value for name, value in os.environ.items() if not name.startswith("TOWER_AGENT_")}
    done = subprocess.run(
        [sys.executable, "-c", LAUNCH, str(folder)],
        cwd=CHECKOUT,
        env=environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_release_that_does_not_link_is_ended_and_taken_back(tmp_path: Path) -> None:
    releases = Releases(tmp_path)
    install(releases, "9.1.0", HANGS)
    releases.begin_trial("9.1.0", 7)
    assert launch(tmp_path) == "hangs\nthe installed agent runs\n"
    assert (releases.current, releases.trial) == ("", None)
    ended = releases.pop_outcome()
    assert ended is not None and (ended.transaction, ended.outcome) == (7, Outcome.FAILED)
    assert "did not link with the tower within" in ended.words and f"back at {VERSION}" in ended.words
    assert releases.pop_outcome() is None


def test_a_release_that_links_stays(tmp_path: Path) -> None:
    releases = Releases(tmp_path)
    install(releases, "9.1.0", LINKS)
    releases.begin_trial("9.1.0", 7)
    assert launch(tmp_path) == "runs as 9.1.0\n"
    assert (releases.current, releases.trial, releases.pop_outcome()) == ("9.1.0", None, None)
    assert launch(tmp_path) == "runs as 9.1.0\n"


def test_a_trial_that_was_interrupted_is_taken_back(tmp_path: Path) -> None:
    releases = Releases(tmp_path)
    install(releases, "9.1.0", LINKS)
    releases.begin_trial("9.1.0", 6)
    releases.accept()
    install(releases, "9.2.0", LINKS)
    releases.begin_trial("9.2.0", 7)
    trial = releases.trial
    assert trial is not None
    releases.trial_runs(trial)  # and then the power goes
    assert launch(tmp_path) == "runs as 9.1.0\n"
    ended = releases.pop_outcome()
    assert ended is not None and "was interrupted before it linked" in ended.words and "back at 9.1.0" in ended.words


def test_a_power_cut_before_the_switch_leaves_what_ran(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    releases = Releases(tmp_path)
    install(releases, "9.1.0", LINKS)
    with monkeypatch.context() as patched:
        patched.setattr(Releases, "_switch", _power_cut)
        with pytest.raises(KeyboardInterrupt):
            releases.begin_trial("9.1.0", 7)
    assert launch(tmp_path) == "the installed agent runs\n"


def _power_cut(*_: object) -> None:
    raise KeyboardInterrupt


@pytest.mark.parametrize("content", [b"no zip", b""])
def test_what_cannot_be_unpacked(tmp_path: Path, content: bytes) -> None:
    releases = Releases(tmp_path)
    releases.incoming.write_bytes(content)
    with pytest.raises(NotInstalled, match="cannot be unpacked"):
        releases.install("9.1.0", releases.incoming)


def test_a_payload_without_an_agent(tmp_path: Path) -> None:
    import io
    import zipfile

    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as archive:
        archive.writestr("../../escaped", "x")
    releases = Releases(tmp_path / "releases")
    releases.incoming.write_bytes(made.getvalue())
    with pytest.raises(NotInstalled, match="holds no agent"):
        releases.install("9.1.0", releases.incoming)
    assert not (tmp_path.parent / "escaped").exists() and not (tmp_path / "escaped").exists()
