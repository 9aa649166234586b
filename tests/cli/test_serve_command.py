"""The command ``serve``: a peer takes part, and what cannot be served is told."""

import json
import os
import socket
import subprocess
import sys
from pathlib import Path

from kankaku.live.simulation import Simulation
from kankaku.studies.opening import NO_SUMO
from tests.cli.command import FAILED, PATIENCE_S, PROJECT, kankaku, refused

SMALL = ("sakai_case1", "--engine", "none", "--seed", "3", "--step", "0.1")


def test_a_peer_takes_part_and_the_tables_are_written(tmp_path: Path) -> None:
    out = tmp_path / "tables"
    command = [sys.executable, "-m", "kankaku", "serve", *SMALL, "--out", str(out)]
    command += ["--timeout", "60"]
    environment = {**os.environ, "PYTHONPATH": str(PROJECT), "KANKAKU_TOKEN": "known"}
    with subprocess.Popen(  # noqa: S603 - ours
        command, cwd=PROJECT, env=environment, stdout=subprocess.PIPE, text=True
    ) as served:
        assert served.stdout is not None
        waiting = served.stdout.readline()
        port = int(waiting.rpartition(":")[2])
        with socket.create_connection(("127.0.0.1", port), PATIENCE_S) as link:
            link.sendall(b'{"kankaku": 1, "token": "guessed"}\n')
            assert b"does not know the token" in link.recv(1000)
        with socket.create_connection(("127.0.0.1", port), PATIENCE_S) as link:
            lines = link.makefile("rw")
            message: dict[str, object] = {"kankaku": 1, "token": "known"}
            seen: dict[str, object] = {}
            while not seen.get("over"):
                if message:
                    lines.write(json.dumps(message) + "\n")
                    lines.flush()
                seen = json.loads(lines.readline())
                message = {"decision": seen["decision"]} if "decision" in seen else {}
        told = served.stdout.read()
        assert served.wait(PATIENCE_S) == 0
    assert "was let go: peer: does not know the token; another peer is waited for" in told
    assert "The run went to its end; 0 violations of safety" in told
    alone = Simulation("sakai_case1", seed=3, step_s=0.1, engine=NO_SUMO)
    for _ in alone:
        pass
    calls = (out / "calls.csv").read_text("utf-8")
    assert calls.count("\n") == len(alone.tables().calls) + 1


def test_without_a_peer_the_command_ends_with_a_sentence(tmp_path: Path) -> None:
    shown = kankaku("serve", *SMALL, "--wait", "0.05", "--out", tmp_path / "tables")
    assert shown.status == FAILED
    assert "no peer came within 0.05 s; 0 violations" in shown.answers
    assert (tmp_path / "tables" / "calls.csv").exists()


def test_what_cannot_be_served_is_refused(tmp_path: Path) -> None:
    (tmp_path / "kept.txt").write_text("mine")
    assert "is open to other machines" in refused("serve", *SMALL, "--host", "0.0.0.0")  # noqa: S104
    assert "allowed: a new or empty folder" in refused("serve", *SMALL, "--out", tmp_path)
    assert "timeout: 0; allowed" in refused("serve", *SMALL, "--timeout", "0")
    assert "interval_s: 0.01" in refused("serve", *SMALL, "--interval", "0.01")
    assert "drives its trains itself" in refused(
        "serve", "rush_hour", "--controller", "sumo_native_moving"
    )
    assert (tmp_path / "kept.txt").read_text() == "mine"
