"""A router's search for others: by scouting, at configured endpoints, by gossip."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from desim.middleware.zenoh.sizes import HELLO_BYTES, SCOUT_BYTES

if TYPE_CHECKING:
    from desim.middleware.zenoh.parameters import ZenohParams
    from desim.middleware.zenoh.router import ZenohRouter
    from desim.ports.middleware import MiddlewareContext
    from desim.ports.networks import Handle


class Finder:
    """The search of one router in one life. A leaf, which does not listen, keeps one link only.

    Scouting never ends. A router dials each other one that answers, once for each hello
    (autoconnect_strategy "always"), one after another (orchestrator.rs awaits connect_peer). Of two
    routers that learn of each other by gossip the one of the higher index (zid) dials
    ("greater-zid"); a peer dials each one that it learns of so (measured). An ``endpoint`` is
    dialled again until there is a link, and when it is lost.
    """

    def __init__(self, host: int, listens: bool, endpoints: list[int], context: MiddlewareContext,
                 params: ZenohParams, routers: Mapping[int, ZenohRouter]) -> None:
        self.listens = listens
        self._host = host
        self._context, self._params, self._constants = context, params, params.constants
        self._routers = routers
        self._endpoints = endpoints
        self._router: ZenohRouter
        self._step_ns = params.constants.scout_first_ns
        self._pauses_ns: dict[int, int] = {}  # before the next call of an endpoint
        self._greeters: dict[int, int] = {}  # to be called, and in which of their lives they are
        self._calling: int | None = None  # a greeter
        self._timers: dict[int, Handle] = {}  # by endpoint, that of scouting by the own host

    def begin(self, router: ZenohRouter) -> None:
        self._router = router
        if self._params.discovery == "multicast":
            stream = self._context.stream("zenoh", "scouts", self._host, router.life)
            self._book(self._host, int(stream.integers(self._constants.scout_jitter_ns + 1)),
                       self._scout)
        for endpoint in self._endpoints if self.listens else self._endpoints[:1]:
            self._book(endpoint, 0, self._call)

    def stop(self) -> None:
        for timer in self._timers.values():
            timer.cancel()

    # Events of the router.

    def linked(self, peer: int) -> None:
        self._pauses_ns.pop(peer, None)
        self._called(peer)

    def unlinked(self, peer: int, was_up: bool) -> None:
        """A link is lost, or did not open."""
        self._called(peer)
        endpoints, constants = self._endpoints, self._constants
        if peer not in endpoints:
            return
        pause_ns = 0
        if not was_up:
            pause_ns = self._pauses_ns.get(peer, constants.retry_first_ns)
            self._pauses_ns[peer] = min(2 * pause_ns, constants.retry_last_ns)
        if not self.listens:
            peer = endpoints[(endpoints.index(peer) + 1) % len(endpoints)]
        self._book(peer, pause_ns, self._call)

    def gossiped(self, peer: int) -> None:
        """Take the gossip that ``peer`` is in the network."""
        router, wants = self._router, False
        if self._params.mode == "peer":
            wants = peer != self._host and not router.calls(peer)
        elif self._params.gossip and self.listens and self._host > peer:
            wants = self._routers[peer].finder.listens and not router.has_link(peer) \
                if peer in self._routers else False
        if wants:
            router.dial(peer)

    # Scouting.

    def _scout(self, _: object) -> None:
        context = self._context
        others = [host for host in range(len(context.hosts)) if host != self._host]
        context.send("scout", self._host, others, SCOUT_BYTES, self._scouted, multicast=True)
        self._book(self._host, self._step_ns, self._scout)
        self._step_ns = min(2 * self._step_ns, self._constants.scout_last_ns)

    def _scouted(self, _: object, host: int) -> None:
        """The scout has arrived at ``host``, whose router answers with a hello."""
        router = self._routers.get(host)
        if router is not None and router.finder.listens:
            self._context.send("hello", host, [self._host], HELLO_BYTES, self._greeted,
                               (host, router.life))

    def _greeted(self, hello: tuple[int, int], _: int) -> None:
        peer, life = hello
        if self._routers.get(self._host) is self._router:
            self._greeters[peer] = life
            self._call_next()

    def _call_next(self) -> None:
        while self._greeters and self._calling is None:
            peer, life = next(iter(self._greeters.items()))
            del self._greeters[peer]
            linked = self._router.has_link(peer, life) if self.listens else self._router.has_link()
            if not linked:
                self._calling = peer
                self._router.dial(peer)

    def _called(self, peer: int) -> None:
        if self._calling == peer:
            self._calling = None
            self._call_next()

    # Endpoints.

    def _call(self, endpoint: int) -> None:
        if not self._router.has_link(endpoint if self.listens else None):
            self._router.dial(endpoint)

    def _book(self, what: int, delay_ns: int, fn: Callable[[int], object]) -> None:
        if what in self._timers:
            self._timers[what].cancel()
        self._timers[what] = self._context.at(self._context.now_ns + delay_ns, self._host, fn, what)
