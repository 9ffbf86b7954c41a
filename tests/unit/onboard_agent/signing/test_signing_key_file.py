"""The signing key on the disk, and the command for the person beside it."""

import io
import logging
import stat
from pathlib import Path

import pytest

from onboard_agent.signing.command import signing
from onboard_agent.signing.key_file import KeyFile
from onboard_agent.signing.signed_line import UNSIGNED
from onboard_agent.unusable import Unusable

OLD, NEW = bytes([1] * 32), bytes(range(32))


@pytest.mark.parametrize("keys", [(NEW,), (OLD, NEW), (UNSIGNED, NEW), (NEW, UNSIGNED)])
def test_keys_are_read_as_they_were_written(tmp_path: Path, keys: tuple[bytes, ...]) -> None:
    file = KeyFile(tmp_path / "drone-1")
    file.write(keys)
    assert KeyFile(tmp_path / "drone-1").read() == keys
    assert stat.S_IMODE(file.path.stat().st_mode) == 0o600


def test_without_a_key_there_is_no_file(tmp_path: Path) -> None:
    file = KeyFile(tmp_path)
    assert file.read() == ()
    file.write((NEW,))
    done = file.keep((UNSIGNED,))
    file.close()
    assert done() and not file.path.exists()
    file.write(())
    assert file.read() == ()


@pytest.mark.parametrize("content", [b"12", b"zz" * 32, b"\xff\xfe", NEW.hex().encode() + b"00"])
def test_a_damaged_file_is_no_key_and_is_not_printed(
    tmp_path: Path, content: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    file = KeyFile(tmp_path)
    file.path.write_bytes(content)
    with caplog.at_level(logging.ERROR):
        assert file.read() == ()
    assert "nothing is signed" in caplog.text
    assert content.decode("latin-1") not in caplog.text


def test_a_disk_that_refuses_is_reported(tmp_path: Path) -> None:
    (tmp_path / "drone-1").write_text("a file, not a folder")
    file = KeyFile(tmp_path / "drone-1")
    done = file.keep((NEW,))
    file.close()
    with pytest.raises(OSError):
        done()


def run(folder: Path, capsys: pytest.CaptureFixture[str], **what: bool) -> str:
    signing(folder, **{"show": False, "take": False, "forget": False, **what})
    return capsys.readouterr().out.strip()


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    assert run(tmp_path, capsys) == "not signed"
    with pytest.raises(Unusable, match="no key"):
        run(tmp_path, capsys, show=True)
    monkeypatch.setattr("sys.stdin", io.StringIO(NEW.hex() + "\n"))
    assert run(tmp_path, capsys, take=True).startswith("signed with the key in")
    assert run(tmp_path, capsys).startswith("signed with the key in")
    assert run(tmp_path, capsys, show=True) == NEW.hex()
    assert run(tmp_path, capsys, forget=True) == "not signed: the agent has no key now"
    monkeypatch.setattr("sys.stdin", io.StringIO("secret\n"))
    with pytest.raises(Unusable, match="32 bytes") as refused:
        run(tmp_path, capsys, take=True)
    assert "secret" not in str(refused.value)
