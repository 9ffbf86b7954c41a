"""The table of shares for the documentation: `python -m server.kernel.shares_table`."""

from server.kernel.shares import SHARES, Whose


def shares_table() -> str:
    """In Markdown."""
    rows = ["| share | what | whose | limit | beyond it |", "|---|---|---|---|---|"]
    for one in SHARES.values():
        limit = f"{one.default:,} ({one.least} to {one.most:,})"
        whose = "all" if one.whose is Whose.TOWER else f"a {one.whose}"
        rows.append(f"| `{one.name}` | {one.what} | {whose} | {limit} | {one.beyond} |")
    return "\n".join(rows)


if __name__ == "__main__":
    print(shares_table())
