"""Exceptions in the log: their location, without the values of variables."""

import subprocess
import sys

import pytest

PROGRAM = """
import structlog
from server.app.log import configure_log
configure_log({form!r})
def sign_in(password):
    raise RuntimeError("no database")
try:
    sign_in("correct" + " horse")
except RuntimeError:
    structlog.get_logger().exception("unexpected_error")
"""


@pytest.mark.parametrize("form", ["human", "json"])
def test_a_trace_shows_no_variables(form: str) -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM.format(form=form)], capture_output=True, text=True, check=True)
    assert "unexpected_error" in done.stderr
    assert "in sign_in" in done.stderr
    assert "no database" in done.stderr
    assert "correct horse" not in done.stderr
