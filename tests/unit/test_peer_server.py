"""The live link over a socket: the same bytes, every mistake told, and nobody hangs."""

import json
import shutil
import socket
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kankaku.analysis.tables.run_tables import RunTables
from kankaku.live.line_advice import LineAdvice
from kankaku.live.peer_server import Offer, PeerServer, ServeError
from kankaku.live.simulation import Simulation
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.studies.opening import NO_SUMO
from kankaku.testing.example_lines import merge_scenario

SPEC = ControllerSpec("test", "moving_block", "close_up", {}, {})
LINE = merge_scenario(3, 60.0, step_s=0.5)
PERL = Path(__file__).parents[2] / "docs" / "examples" / "other_language" / "slow_when_near.pl"
LONG_S = 60.0
TOKEN = "a secret of many letters"  # noqa: S105 - of tests
LET_GO: list[str] = []
"""What was told of peers that may not take part."""


def simulation() -> Simulation:
    return Simulation(LINE, SPEC, 1, engine=NO_SUMO)


def bytes_of(tables: RunTables) -> dict[str, str]:
    return {name: frame.to_csv() for name, frame in tables.frames.items()}


class Peer:
    """The other end of a link."""

    def __init__(self, port: int) -> None:
        self.port = port
        self._link = socket.create_connection(("127.0.0.1", port), timeout=LONG_S)
        self._lines = self._link.makefile("rb")

    def say(self, message: Any) -> None:  # noqa: ANN401 - what JSON holds, or bytes
        line = message if isinstance(message, bytes) else json.dumps(message).encode()
        self._link.sendall(line + b"\n")

    def hear(self) -> dict[str, Any]:
        heard: dict[str, Any] = json.loads(self._lines.readline())
        return heard

    def close(self) -> None:
        self._lines.close()
        self._link.close()


@contextmanager
def served(
    play: Callable[[Peer], None], timeout_s: float = LONG_S, token: str = ""
) -> Iterator[tuple[Simulation, str]]:
    """Yield a simulation that a peer has played with, and why it ended."""
    stepped, errors = simulation(), list[BaseException]()
    with PeerServer(Offer(timeout_s=timeout_s, token=token, wait_s=LONG_S)) as server:

        def act() -> None:
            peer = Peer(server.port)
            try:
                play(peer)
            except BaseException as error:  # noqa: BLE001 - told by the other thread
                errors.append(error)
            finally:
                peer.close()

        acting = threading.Thread(target=act)
        acting.start()
        why = server.serve(stepped, LET_GO.append)
        acting.join(LONG_S)
    assert not errors
    yield stepped, why


@pytest.fixture(autouse=True)
def nobody_let_go() -> None:
    LET_GO.clear()


def slowing(seen: dict[str, Any]) -> dict[str, Any]:
    rows = zip(seen["running"], seen["eoa_m"], seen["front_m"], strict=True)
    asked = [12.5 if running and eoa - front < 600.0 else None for running, eoa, front in rows]
    return {"decision": seen["decision"], "ceiling_mps": asked}


def greet(peer: Peer, token: str = "") -> dict[str, Any]:
    peer.say({"kankaku": 1, "token": token})
    return peer.hear()


def by_steps() -> RunTables:
    stepped = simulation()
    for view in stepped:
        near = view.running & (view.eoa_m - view.front_m < 600.0)
        stepped.step(LineAdvice(ceiling_mps=np.where(near, 12.5, np.inf)))
    return stepped.tables()


def test_a_peer_is_the_same_as_steps_in_the_process() -> None:
    def play(peer: Peer) -> None:
        hello = greet(peer)
        assert hello["trains"] == ["T1", "T2", "T3"]
        assert hello["interval_s"] == 10.0
        while not (seen := peer.hear()).get("over"):
            peer.say(slowing(seen))
        assert seen["violations"] == 0

    with served(play) as (stepped, why):
        assert not why
        assert bytes_of(stepped.tables()) == bytes_of(by_steps())


@pytest.mark.skipif(shutil.which("perl") is None, reason="there is no Perl")
def test_a_controller_in_another_language_is_the_same() -> None:
    stepped = simulation()
    with PeerServer(Offer(timeout_s=LONG_S, wait_s=LONG_S)) as server:
        command = ["perl", str(PERL), str(server.port)]
        with subprocess.Popen(command) as perl:  # noqa: S603 - the example
            why = server.serve(stepped)
            assert perl.wait(LONG_S) == 0
    assert not why
    assert bytes_of(stepped.tables()) == bytes_of(by_steps())


MALFORMED: tuple[Any, ...] = (
    b"",
    b"}{",
    b"\xff\xfe\x00",
    b"NaN",
    b"[" * 50_000,
    b'{"decision": 1e999}',
    b"9" * 5_000,
    [],
    "brake",
    {"decision": -1},
    {"decision": True},
    {"decision": 0, "speed": 3},
    {"decision": 0, "ceiling_mps": "fast"},
    {"decision": 0, "ceiling_mps": [1.0]},
    {"decision": 0, "ceiling_mps": {"T9": 1.0}},
    {"decision": 0, "ceiling_mps": -1.0},
    {"decision": 0, "target_mps": [True, None, None]},
    {"decision": 0, "hold_until_s": 10**400},
    {"decision": 0, "hold_until_s": {"T1": []}},
    {"decision": 0, "reason": [0, 0, 7]},
    {"decision": 0, "reason": [0.0, 0, 0]},
    {"decision": 0, "cause": "T1"},
    b'{"decision": 0, "ceiling_mps": Infinity}',
)


def test_a_thousand_malformed_messages_are_told_and_change_nothing() -> None:
    sent = [MALFORMED[number % len(MALFORMED)] for number in range(1000)]

    def play(peer: Peer) -> None:
        greet(peer)
        seen = peer.hear()
        assert seen["decision"] == 0
        for message in sent:
            peer.say(message)
            assert "allowed: " in peer.hear()["error"]
        while not seen.get("over"):
            peer.say(slowing(seen))
            seen = peer.hear()

    with served(play) as (stepped, why):
        assert not why
        assert stepped.record().violations == ()
        assert bytes_of(stepped.tables()) == bytes_of(by_steps())


def test_a_malformed_greeting_is_told_and_another_one_heard() -> None:
    def play(peer: Peer) -> None:
        for message in (*MALFORMED, {"kankaku": True}, {"kankaku": [1]}):
            peer.say(message)
            assert "allowed: " in peer.hear()["error"]
        greet(peer)

    with served(play) as (_, why):
        assert why
    assert not LET_GO


def silent(peer: Peer) -> None:
    greet(peer)
    for _ in range(12):
        peer.say(slowing(peer.hear()))
    # Until the other end has had enough of it.
    while not peer.hear().get("over"):
        pass


def gone(peer: Peer) -> None:
    greet(peer)
    for _ in range(12):
        peer.say(slowing(peer.hear()))


def endless(peer: Peer) -> None:
    greet(peer)
    peer.hear()
    peer.say(b" " * 1_200_000)


@pytest.mark.parametrize(
    ("play", "told", "timeout_s"),
    [
        (silent, "gave no answer within 0.2 s", 0.2),
        (gone, "closed the link|broke the link", LONG_S),
        (endless, "sent a line of more than 1000000 bytes", LONG_S),
    ],
)
def test_when_a_peer_is_lost_trains_brake_and_the_run_ends_with_a_sentence(
    play: Callable[[Peer], None], told: str, timeout_s: float
) -> None:
    with served(play, timeout_s) as (stepped, why):
        record = stepped.record()
        assert any(part in why for part in told.split("|"))
        assert record.failure == why
        assert record.violations == ()
        assert not stepped.state.speed_mps.any()
        assert not record.completed.all()


# JSON can tell half of a character, which no UTF-8 can.
@pytest.mark.parametrize("guess", ["guessed", "", None, [TOKEN], "\ud800"])
def test_who_does_not_know_the_token_is_let_go_and_who_does_is_waited_for(guess: object) -> None:
    def wrong_and_right(wrong: Peer) -> None:
        wrong.say({"kankaku": 2, "token": TOKEN})
        assert "allowed: version 1" in wrong.hear()["error"]
        wrong.say({"kankaku": 1, "token": guess})
        told = {"over": True, "failure": "peer: does not know the token"}
        assert wrong.hear() == told
        with closing(Peer(wrong.port)) as right:
            assert greet(right, TOKEN)["seed"] == 1
            while not (seen := right.hear()).get("over"):
                right.say(slowing(seen))

    with served(wrong_and_right, token=TOKEN) as (stepped, why):
        assert not why
        assert bytes_of(stepped.tables()) == bytes_of(by_steps())
    told = "Somebody from 127.0.0.1 was let go: peer: does not know the token"
    assert [f"{told}; another peer is waited for"] == LET_GO


def test_who_leaves_or_is_silent_before_the_run_begins_does_not_end_it() -> None:
    def play(first: Peer) -> None:
        first.close()
        with closing(Peer(first.port)) as silent_one:
            assert silent_one.hear()["failure"] == "peer: gave no answer within 1 s"
        with closing(Peer(first.port)) as right:
            greet(right)

    with served(play, timeout_s=1.0) as (_, why):
        assert why
    assert ["the link" in told for told in LET_GO] == [True, False]


def test_patience_ends_whoever_came_in_vain() -> None:
    stepped = simulation()
    server = PeerServer(Offer(token=TOKEN, wait_s=1.0))
    with server, closing(Peer(server.port)) as peer:
        peer.say({"kankaku": 1, "token": "guessed"})
        assert server.serve(stepped, LET_GO.append) == "no peer came within 1 s"
        assert peer.hear()["over"]
    assert len(LET_GO) == 1
    assert stepped.record().violations == ()


@pytest.mark.parametrize("host", ["0.0.0.0", "192.0.2.1", "example.org", "::"])  # noqa: S104
def test_other_machines_are_let_in_with_a_token_only(host: str) -> None:
    with pytest.raises(ServeError, match=r"open to other machines; allowed: 127\.0\.0\.1, or"):
        PeerServer(Offer(host=host, token="short"))  # noqa: S106


def test_without_a_peer_the_run_ends_with_a_sentence() -> None:
    stepped = simulation()
    with PeerServer(Offer(wait_s=0.05)) as server:
        assert server.serve(stepped) == "no peer came within 0.05 s"
    assert stepped.record().failure == "no peer came within 0.05 s"
