"""A release needs a stamp of the long tests for the very content of the checkout."""

import subprocess
from pathlib import Path

import pytest
from packages.long_stamp import STAMP, NotTested, require_stamp, write_stamp


def git(checkout: Path, *words: str) -> None:
    who = ("-c", "user.name=tests", "-c", "user.email=tests@example.com")
    subprocess.run(["git", *who, *words], cwd=checkout, check=True, capture_output=True)


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    git(tmp_path, "init")
    (tmp_path / ".gitignore").write_text(".pytest_cache\n")
    (tmp_path / "code").write_text("1")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-m", "First")
    return tmp_path


def test_the_stamp_counts_for_this_content(checkout: Path) -> None:
    assert write_stamp(checkout).startswith("stamped")
    assert require_stamp(checkout)
    git(checkout, "commit", "--allow-empty", "-m", "The same content")
    assert require_stamp(checkout)


def test_none_without_a_run(checkout: Path) -> None:
    with pytest.raises(NotTested, match="have not passed"):
        require_stamp(checkout)


@pytest.mark.parametrize("text", ["", "[]", "{}", "7", '{"tree": "x"}'])
def test_an_unreadable_stamp_is_none(checkout: Path, text: str) -> None:
    (checkout / STAMP).parent.mkdir()
    (checkout / STAMP).write_text(text)
    with pytest.raises(NotTested, match="have not passed"):
        require_stamp(checkout)


def test_another_commit_or_an_open_change_ends_it(checkout: Path) -> None:
    write_stamp(checkout)
    (checkout / "code").write_text("2")
    with pytest.raises(NotTested, match="has changed"):
        require_stamp(checkout)
    git(checkout, "commit", "-am", "Second")
    with pytest.raises(NotTested, match="has changed"):
        require_stamp(checkout)


def test_a_run_with_open_changes_stamps_nothing(checkout: Path) -> None:
    (checkout / "new").write_text("2")
    assert write_stamp(checkout).startswith("no stamp")
    assert not (checkout / STAMP).exists()
