"""The middleware ``zenoh``: a router on each host, as with rmw_zenoh, or a peer."""

from __future__ import annotations

from desim.errors import InputError, host_index
from desim.middleware.tcp import Tcp
from desim.middleware.zenoh.discovery import Finder
from desim.middleware.zenoh.parameters import ZenohParams
from desim.middleware.zenoh.publication import ZenohPublication
from desim.middleware.zenoh.registry import Declaration
from desim.middleware.zenoh.router import ZenohRouter
from desim.middleware.zenoh.sizes import node_bytes, subscriber_bytes, token_bytes
from desim.ports.middleware import Addressing, Advertisement, Endpoint, MiddlewareContext, Transport


class Zenoh:
    """A publisher's messages go to the hosts whose subscribers its router has learnt of.

    Reasons for which messages are dropped: ``congested`` (no room in time), ``link_closed`` (they
    were on a link that was given up), ``unknown_key`` (on a new link that its sender took for the
    old one), ``sender_down``, ``no_route`` (the way was lost meanwhile).
    """

    Params = ZenohParams
    informed = "publisher"
    shares_links = True

    def __init__(self, params: ZenohParams | None = None) -> None:
        self._params = params or ZenohParams()
        self._routers: dict[int, ZenohRouter] = {}
        self._nodes: dict[tuple[int, str], None] = {}  # with declared tokens

    def start(self, context: MiddlewareContext) -> None:
        self._context = context
        self._tcp = Tcp(context, self._params.tcp)
        self._with_router = self._hosts("routers") or list(range(len(context.hosts)))
        self._endpoints = self._hosts("connect")
        if self._params.mode == "peer" and self._params.routers:
            raise InputError(".routers: peers have none; leave it out, or take mode router")
        if self._params.discovery == "connect" and not self._endpoints:
            raise InputError(".connect: discovery connect finds nobody without endpoints; name "
                             "hosts, or take discovery multicast")
        for number, host in enumerate(self._endpoints):
            if host not in self._with_router:
                raise InputError(f".connect.{number}: {context.hosts[host]} has no router")

    def switched(self, host: int, up: bool) -> None:
        if up:
            endpoints = [other for other in self._endpoints if other != host]
            finder = Finder(host, host in self._with_router, endpoints, self._context,
                            self._params, self._routers)
            self._tcp.switched(host, True)
            self._routers[host] = ZenohRouter(host, self._context, self._params, self._tcp, finder)
        else:
            router = self._routers.pop(host, None)
            if router is not None:
                router.stop()
            self._nodes = {node: None for node in self._nodes if node[0] != host}
            self._tcp.switched(host, False)

    def advertise(self, advertised: Advertisement) -> None:
        host, node, topic = publisher = advertised.publisher
        if host in self._routers:
            tokens = self._tokens(publisher)
            if self._routers[host].registry.publishes(topic):
                tokens.append(Declaration(token_bytes(node, topic), None))
            self._routers[host].declare(tokens)

    def subscribe(self, subscriber: Endpoint) -> None:
        host, node, topic = subscriber
        if host in self._routers:
            tokens = self._tokens(subscriber)
            registry = self._routers[host].registry
            if host not in registry.listeners(topic):
                registry.listens(topic)
                tokens += [Declaration(subscriber_bytes(topic), topic),
                           Declaration(token_bytes(node, topic), None)]
            self._routers[host].declare(tokens)

    def subscribers(self, publisher: Endpoint) -> tuple[Endpoint, ...]:
        router = self._routers.get(publisher.host)
        return () if router is None else tuple(
            Endpoint(host, "", publisher.topic)
            for host in router.registry.listeners(publisher.topic))

    def transport(self, advertised: Advertisement) -> Transport:
        if advertised.via != Addressing.UNICAST:
            raise InputError(f".via: zenoh has no {advertised.via}; allowed: unicast")
        return ZenohPublication(advertised, self._context, self._routers.__getitem__)

    def _tokens(self, end: Endpoint) -> list[Declaration]:
        """The liveliness token of the endpoint's node, if it is not declared yet."""
        if (end.host, end.node) in self._nodes:
            return []
        self._nodes[end.host, end.node] = None
        return [Declaration(node_bytes(end.node), None)]

    def _hosts(self, name: str) -> list[int]:
        """The indices of the hosts that this parameter names."""
        return [host_index(f"{name}.{number}", host, self._context.hosts)
                for number, host in enumerate(getattr(self._params, name))]
