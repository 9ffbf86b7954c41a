"""Starts Chromium at a low priority."""

import os
import shlex
import shutil
from pathlib import Path


def modest(program: str, folder: Path) -> Path:
    """Returns a script in `folder` that starts Chromium at a low priority.

    Chromium run by root would raise the priority of its drawing above everything else on the machine, including the
    drones of this test and of parallel ones.
    """
    drop = "setpriv --bounding-set=-sys_nice " if os.geteuid() == 0 and shutil.which("setpriv") else ""
    script = folder / "chromium"
    script.write_text(f'#!/bin/sh\nexec {drop}nice -n 5 {shlex.quote(program)} "$@"\n')
    script.chmod(0o700)
    return script
