"""Serves a simulation to a peer over a socket; if it is dead or slow, trains brake and all ends."""

import hmac
import ipaddress
import json
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self

from kankaku.live.line_advice import LineAdvice
from kankaku.live.line_protocol import (
    LONGEST_LINE,
    VERSION,
    ProtocolError,
    advice_in,
    decision,
    greeting,
    parsed,
)
from kankaku.live.simulation import Simulation
from kankaku.railway.errors import KankakuError

LOOPBACK = "127.0.0.1"
LEAST_TOKEN = 16
"""Characters of a token, where one is needed. [-]"""
BRAKING_S = 900.0
"""Trains whose peer is gone stand after this time at the latest, or the run ends all the same."""


class ServeError(KankakuError):
    """A live link that cannot be offered."""


class PeerGoneError(KankakuError):
    """A peer that has closed the link, says nothing in time, or does not know the token."""


@dataclass(frozen=True, slots=True)
class Offer:
    """Where a peer may come to, and how long it is waited for."""

    host: str = LOOPBACK
    port: int = 0
    """0 for any that is free."""
    token: str = ""
    """What the peer has to say first; may be empty on loopback only."""
    timeout_s: float = 5.0
    """Wall time for each answer. [s]"""
    wait_s: float = 60.0
    """Wall time for a peer to come. [s]"""


class PeerServer:
    """
    Offers a simulation to one peer.

    Parameters
    ----------
    offer
        Where, to whom, and for how long.

    Raises
    ------
    ServeError
        If the place is taken or none, or is open to other machines without a token.
    """

    def __init__(self, offer: Offer) -> None:
        refuse_open(offer)
        self._offer = offer
        try:
            self._listening = socket.create_server((offer.host, offer.port), backlog=1)
        except (OSError, OverflowError) as error:
            where = f"{offer.host}:{offer.port}"
            raise ServeError(where, f"cannot be listened at: {error}", "a free port") from error

    @property
    def port(self) -> int:
        """Where the peer may come to."""
        return int(self._listening.getsockname()[1])

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._listening.close()

    def serve(self, simulation: Simulation, tell: Callable[[str], None] = lambda _: None) -> str:
        """
        Run a simulation to its end with the first peer that may take part.

        Whoever does not know the token, or leaves before it was greeted, is told so and let go;
        another one is waited for.

        Parameters
        ----------
        simulation
            It is reset first; afterwards it is over.
        tell
            Called with a sentence for everybody who was let go.

        Returns
        -------
        str
            Why it ended before its end; empty if it did not. The record says so, too.
        """
        simulation.reset()
        talking, peer = self._welcomed(simulation, tell)
        if talking is None or peer is None:
            why = f"no peer came within {self._offer.wait_s:g} s"
            simulation.end(why)
            return why
        with talking:
            try:
                _play(peer, simulation)
            except PeerGoneError as gone:
                why = str(gone)
                bring_to_a_stand(simulation)
                simulation.end(why)
                peer.dismiss(why)
                return why
        return ""

    def _welcomed(
        self, simulation: Simulation, tell: Callable[[str], None]
    ) -> "tuple[socket.socket, _Peer] | tuple[None, None]":
        """Return the first peer that may take part; None if patience ends before it comes."""
        until_s = time.monotonic() + self._offer.wait_s
        while (left_s := until_s - time.monotonic()) > 0.0:
            self._listening.settimeout(left_s)
            try:
                talking, (host, *_) = self._listening.accept()
            except TimeoutError:
                break
            peer = _Peer(talking, self._offer.timeout_s)
            try:
                self._greet(peer, simulation)
            except PeerGoneError as gone:
                peer.dismiss(str(gone))
                talking.close()
                tell(f"Somebody from {host} was let go: {gone}; another peer is waited for")
            except BaseException:
                talking.close()
                raise
            else:
                return talking, peer
        return None, None

    def _greet(self, peer: "_Peer", simulation: Simulation) -> None:
        def hello(message: dict[str, Any]) -> None:
            known = message.get("kankaku")
            if known != VERSION or isinstance(known, bool):
                where = "kankaku"
                raise ProtocolError(where, f"{known!r:.80}", f"version {VERSION}")
            # JSON may hold half of a character, which UTF-8 does not.
            given = str(message.get("token", "")).encode(errors="replace")
            if not hmac.compare_digest(given, self._offer.token.encode()):
                where, told = "peer", "does not know the token"
                raise PeerGoneError(where, told)

        peer.answer(None, hello)
        peer.say(greeting(simulation, self._offer.timeout_s))


class _Peer:
    """Whoever is at the other end."""

    def __init__(self, talking: socket.socket, timeout_s: float) -> None:
        self._talking, self._timeout_s, self._buffer = talking, timeout_s, bytearray()

    def say(self, message: dict[str, Any]) -> None:
        """Send a line."""
        self._talking.settimeout(self._timeout_s)
        try:
            self._talking.sendall(json.dumps(message, allow_nan=False).encode() + b"\n")
        except (TimeoutError, OSError) as error:
            where, told = "peer", "does not listen any more"
            raise PeerGoneError(where, told) from error

    def dismiss(self, why: str) -> None:
        """Say why it is over, to a peer that may have gone."""
        with suppress(PeerGoneError):
            self.say({"over": True, "failure": why})

    def answer(self, asked: dict[str, Any] | None, take: Callable[[dict[str, Any]], None]) -> None:
        """Ask, and hear answers until one is taken, each mistake told, or the time is over."""
        if asked is not None:
            self.say(asked)
        until_s = time.monotonic() + self._timeout_s
        while True:
            line = self._line(until_s)
            try:
                take(parsed(line))
            except PeerGoneError:
                raise
            except KankakuError as error:
                self.say({"error": str(error)[:500]})
            else:
                return

    def _line(self, until_s: float) -> bytes:
        where = "peer"
        while (end := self._buffer.find(b"\n")) < 0:
            if len(self._buffer) > LONGEST_LINE:
                raise PeerGoneError(where, f"sent a line of more than {LONGEST_LINE} bytes")
            left_s = until_s - time.monotonic()
            if left_s <= 0.0:
                raise PeerGoneError(where, f"gave no answer within {self._timeout_s:g} s")
            self._talking.settimeout(left_s)
            try:
                heard = self._talking.recv(65_536)
            except TimeoutError:
                continue
            except OSError as error:
                raise PeerGoneError(where, "broke the link") from error
            if not heard:
                raise PeerGoneError(where, "closed the link")
            self._buffer += heard
        line = bytes(self._buffer[:end])
        del self._buffer[: end + 1]
        if time.monotonic() > until_s:
            raise PeerGoneError(where, f"gave no answer within {self._timeout_s:g} s")
        return line


def _play(peer: _Peer, simulation: Simulation) -> None:
    number, trains = 0, simulation.world.size
    while not simulation.over:
        asked = decision(number, simulation.state, simulation.report)

        def take(message: dict[str, Any], number: int = number) -> None:
            simulation.step(advice_in(message, number, trains))

        peer.answer(asked, take)
        number += 1
    over = {"over": True, "time_s": simulation.state.time_s, "violations": simulation.violations}
    # Who has left already need not hear it.
    with suppress(PeerGoneError):
        peer.say({**over, "failure": ""})


def bring_to_a_stand(simulation: Simulation) -> None:
    """
    Let all trains brake until they stand.

    Parameters
    ----------
    simulation
        One that is not over; it may be afterwards.
    """
    began_s = simulation.state.time_s
    while not simulation.over and simulation.state.time_s < began_s + BRAKING_S:
        view = simulation.step(LineAdvice(ceiling_mps=0.0))
        if not view.speed_mps.any():
            return


def refuse_open(offer: Offer) -> None:
    """
    Refuse an offer to other machines without a token.

    Parameters
    ----------
    offer
        Where, and to whom.

    Raises
    ------
    ServeError
        If the host is no address of this machine alone, and the token too short.
    """
    try:
        at_home = offer.host == "localhost" or ipaddress.ip_address(offer.host).is_loopback
    except ValueError:
        at_home = False
    if not at_home and len(offer.token) < LEAST_TOKEN:
        allowed = f"{LOOPBACK}, or a token of {LEAST_TOKEN} characters or more"
        raise ServeError(offer.host, "is open to other machines", allowed)
    for name, value in (("timeout", offer.timeout_s), ("wait", offer.wait_s)):
        if not 0.0 < value <= 86_400.0:
            raise ServeError(name, f"{value:g}", "more than 0 s, up to a day")
