"""docs/alerts.md shows the current table of rules."""

from pathlib import Path
from typing import Final

from server.alerts.core.rules_table import rules_table

PAGE: Final = (Path(__file__).resolve().parents[3] / "docs" / "alerts.md").read_text()


def test_the_table_in_the_document_is_that_of_the_code() -> None:
    assert rules_table() in PAGE, "run: python -m server.alerts.core.rules_table"


def test_no_line_is_too_long() -> None:
    assert max(map(len, PAGE.splitlines())) <= 120
