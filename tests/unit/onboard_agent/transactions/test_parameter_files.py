"""Stored tables on disk: one file for each autopilot, a maximum number, and no error without a disk."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from onboard_agent.transactions.parameter_files import MAX_FILES, ParameterFiles


def test_a_record_is_replaced_whole_and_the_oldest_go(tmp_path: Path) -> None:
    files = ParameterFiles(tmp_path / "parameters")
    assert files.load("chip-1") is None
    files.save("chip-1", b"old")
    files.save("chip-1", b"new")
    assert ParameterFiles(tmp_path / "parameters").load("chip-1") == b"new"
    for number in range(2, MAX_FILES + 3):
        for path in (tmp_path / "parameters").iterdir():
            os.utime(path, (path.stat().st_mtime - 10, path.stat().st_mtime - 10))
        files.save(f"chip-{number}", b"one")
    assert files.load("chip-1") is files.load("chip-2") is None
    assert files.load("chip-3") == b"one"
    assert len(list((tmp_path / "parameters").iterdir())) == MAX_FILES


def test_no_disk_is_no_memory(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    ParameterFiles(None).save("chip-1", b"one")
    assert ParameterFiles(None).load("chip-1") is None
    (tmp_path / "file").touch()
    ParameterFiles(tmp_path / "file").save("chip-1", b"one")
    assert "cannot be remembered" in caplog.text
