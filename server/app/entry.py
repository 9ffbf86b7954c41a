"""The console script `tower`. It only selects the package: `tower connect` runs on machines without a tower, and must
not load a database to start. Nor must `tower --version`."""

import sys


def main() -> None:
    """Passes `tower connect ...` to the `connect` package, everything else to the tower's own commands."""
    if sys.argv[1:2] == ["connect"]:
        from connect.cli import main as connect_main

        connect_main(sys.argv[2:])
    elif sys.argv[1:] == ["--version"]:
        from server import VERSION

        print(VERSION)
    else:
        from server.runtime.garbage import unsearched

        with unsearched():
            from server.app.cli import main as tower_main
        tower_main()
