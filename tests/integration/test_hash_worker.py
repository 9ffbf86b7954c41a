"""The process that hashes passwords ends with the tower's input, and not by a signal that was meant for the tower."""

from __future__ import annotations

import json
import signal
import subprocess
import sys

import pytest


def ask(worker: subprocess.Popen[bytes], number: int) -> object:
    assert worker.stdin is not None and worker.stdout is not None
    question = {"id": number, "password": "correct horse", "memory_kib": 64, "rounds": 1}
    worker.stdin.write(json.dumps(question).encode() + b"\n")
    worker.stdin.flush()
    answer = json.loads(worker.stdout.readline())
    assert answer["id"] == number
    return answer["answer"]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT], ids=["systemd stops the unit", "Ctrl-C"])
def test_a_signal_to_all_processes_leaves_it_working_until_the_tower_ends(number: signal.Signals) -> None:
    words = [sys.executable, "-m", "server.accounts.store.hash_worker", "1"]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as worker:
        assert str(ask(worker, 1)).startswith("$argon2id$")
        worker.send_signal(number)
        assert str(ask(worker, 2)).startswith("$argon2id$")
        assert worker.stdin is not None
        worker.stdin.close()
        assert worker.wait(60) == 0
