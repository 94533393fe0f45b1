"""All ROS 1 processes of a run, their masters, and the part of a middleware that they share."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from desim.errors import InputError
from desim.middleware.ros1.client import Process
from desim.middleware.ros1.master import IdleThreads, Master, MasterCall, Uri
from desim.middleware.ros1.parameters import RosParams
from desim.middleware.ros1.sizes import CALLS
from desim.middleware.ros1.transports import Tcpros, Udpros
from desim.middleware.ros1.xmlrpc import XmlRpc, XmlRpcCall
from desim.middleware.tcp import Tcp
from desim.ports.middleware import (
    Addressing,
    Advertisement,
    Endpoint,
    HostState,
    MiddlewareContext,
    Transport,
    TransportKind,
)

Method = Callable[..., tuple[object, ...]]  # of a master: the addresses or topics of its answer

_METHODS: dict[str, Method] = {"registerPublisher": Master.register_publisher,
                               "registerSubscriber": Master.register_subscriber,
                               "hasParam": Master.has_parameter,
                               "getPublishedTopics": Master.published_topics}


class Processes:
    """The process on each host that runs. ``master_of`` gives, by host index, the host whose master
    it knows; a master lives as long as its host. ``sees(believer, other, state)`` is called as
    links open and close (None: something else decides who is online); ``more`` are methods of
    masters beside registration."""

    def __init__(self, context: MiddlewareContext, params: RosParams, master_of: list[int],
                 sees: Callable[[int, int, HostState], object] | None,
                 more: dict[str, Method] | None = None) -> None:
        self.context = context
        self.sees = sees
        self.params, self.constants = params, params.constants
        self.tcp = Tcp(context, params.tcp)
        self.rpc = XmlRpc(context, self.tcp, local_ns=self.constants.local_call_ns)
        self.masters: dict[int, Master] = {}  # by host
        self._methods = _METHODS | (more or {})
        self._master_of = master_of
        self._processes: dict[int, Process] = {}

    def on(self, host: int) -> Process:
        """The process that runs on ``host`` now."""
        process = self._processes.get(host)
        if process is None:
            uri = Uri(host, self.context.life(host))
            process = self._processes[host] = Process(self, uri, self._master_of[host])
        return process

    def switched(self, host: int, up: bool) -> None:
        if up:
            if host in self._master_of:
                self.masters[host] = Master(self._threads(host), partial(self._make_call, host))
                self.rpc.serve(host, "master", self._serve)
            self.on(host)
            return
        process = self._processes.pop(host, None)
        if process is not None:
            process.stop()
        self.masters.pop(host, None)
        self.rpc.forget(host)
        self.tcp.switched(host, False)

    # Masters.

    def _threads(self, host: int) -> IdleThreads:
        """The idle threads of a master, which poll at times of their own."""
        context, constants = self.context, self.constants
        stream = context.stream("rosmaster", context.hosts[host], context.life(host))
        asleep_ns = [context.now_ns + int(stream.integers(constants.worker_poll_ns + 1))
                     for _ in range(constants.workers)]
        return IdleThreads(constants.worker_poll_ns, asleep_ns, lambda: context.now_ns,
                           lambda time_ns, fn: context.at(time_ns, host, lambda _: fn()))

    def _serve(self, call: XmlRpcCall) -> None:
        method, *arguments = call.request
        known = self._methods[method](self.masters[call.server], *arguments)
        sizes = CALLS[method]
        call.reply(sizes.answer + sizes.answer_each * len(known), known)

    def _make_call(self, host: int, task: MasterCall, done: Callable[[], object]) -> None:
        sizes = CALLS[task.method]
        self.rpc.call(host, task.uri.host, task.uri.slave, task.method,
                      sizes.call + sizes.call_each * len(task.publishers),
                      (task.method, task.topic, task.publishers), lambda ok, _: done())


class RosMiddleware:
    """The part that ``ros1`` and ``multimaster`` share: each request goes to the process on its
    host."""

    informed = "subscriber"
    processes: Processes

    def switched(self, host: int, up: bool) -> None:
        self.processes.switched(host, up)

    def advertise(self, advertised: Advertisement) -> None:
        self.processes.on(advertised.publisher.host).advertise(advertised.publisher.topic)

    def subscribe(self, subscriber: Endpoint) -> None:
        if self.processes.on(subscriber.host).subscribe(subscriber):
            self.processes.context.changed(subscriber.topic)

    def subscribers(self, publisher: Endpoint) -> tuple[Endpoint, ...]:
        process = self.processes.on(publisher.host)
        return tuple(sorted(process.subscribers(publisher.topic)))

    def transport(self, advertised: Advertisement) -> Transport:
        if advertised.via != Addressing.UNICAST:
            raise InputError(f".via: ROS 1 has no {advertised.via}; allowed: unicast")
        context, host = self.processes.context, advertised.publisher.host
        publication = self.processes.on(host).publication(advertised.publisher.topic,
                                                          advertised.transport)
        if publication.transport == TransportKind.STREAM:
            return Tcpros(context, host, publication, advertised.queue,
                          self.processes.params.client == "rospy")
        datagrams = advertised._replace(transport=TransportKind.DATAGRAM)
        return Udpros(context.default_transport(datagrams), publication)
