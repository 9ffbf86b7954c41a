"""Exceptions in the log: their location, without the values of variables."""

import json
import subprocess
import sys

import pytest

from server.anonymous.core.limits import LIMITS

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


STORM = """
import structlog
from server.app.log import configure_log
configure_log("json")
for number in range(500):
    structlog.get_logger().error("database_unavailable", path="/api/v1/me\\nlink_down")
    structlog.get_logger().error("link_down", number=number)
"""


def test_a_storm_of_one_error_is_bounded_and_its_text_stays_in_its_line() -> None:
    done = subprocess.run([sys.executable, "-c", STORM], capture_output=True, text=True, check=True)
    lines = [json.loads(line) for line in done.stderr.splitlines()]
    storm = [line for line in lines if line["event"] == "database_unavailable"]
    assert LIMITS.log_lines_burst <= len(storm) < 2 * LIMITS.log_lines_burst
    assert len(lines) == len(storm) + 500
    assert storm[0]["path"] == "/api/v1/me\nlink_down"
