"""Writes the table of rules for docs/alerts.md, from the table itself. Pure.

`python -m server.alerts.core.rules_table` prints it.
"""

from textwrap import wrap

from server.alerts.core.rules import RULES


def rules_table() -> str:
    """Markdown, the most urgent rule first."""
    lines = ["| rule | severity | badge | opens after | closes after |", "|---|---|---|---|---|"]
    for rule in RULES:
        opens, closes = f"{rule.opens_after_s:g} s", f"{rule.closes_after_s:g} s"
        lines.append(f"| `{rule.name}` | {rule.severity.value} | {rule.badge} | {opens} | {closes} |")
    lines.append("")
    for rule in RULES:
        text = f"- **`{rule.name}`**: {rule.when}. *What to do:* {rule.advice}"
        lines += wrap(text, 118, subsequent_indent="  ", break_on_hyphens=False)
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(rules_table(), end="")
