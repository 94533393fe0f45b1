"""A ROS 1 process: its registrations at the master, and its ends of links."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from desim.middleware.ros1.links import RosLink
from desim.middleware.ros1.master import Uri
from desim.middleware.ros1.rospy_links import RospyLink
from desim.middleware.ros1.sizes import CALLS, REQUEST_TOPIC
from desim.middleware.ros1.xmlrpc import XmlRpcCall, XmlrpcThread
from desim.ports.middleware import Endpoint, HostState, TransportKind

if TYPE_CHECKING:
    from desim.middleware.ros1.processes import Processes
    from desim.middleware.tcp import Connection


_LINKS = {"roscpp": RosLink, "rospy": RospyLink}


class RosPublication:
    """One topic that a process publishes. ``connections`` lead to subscribing hosts; with UDPROS,
    ``links`` have asked for it. A host with a new connection is a new receiver."""

    def __init__(self, transport: TransportKind) -> None:
        self.transport = transport
        self.connections: dict[int, Connection] = {}
        self.links: dict[int, RosLink] = {}
        self.ends: dict[int, Endpoint] = {}


class RosSubscription:
    """One topic that a process subscribes to: its subscribing nodes, the publishers in the last
    answer of the master, and the links to those on other hosts."""

    def __init__(self) -> None:
        self.ends: list[Endpoint] = []
        self.answer: tuple[Uri, ...] = ()
        self.links: dict[Uri, RosLink] = {}


class Process:
    """All nodes of ``uri.host``, from its start to its stop. ``master``: the host whose master they
    know."""

    def __init__(self, processes: Processes, uri: Uri, master: int) -> None:
        self.processes = processes
        self.uri = uri
        self.host = uri.host
        self.master = master
        self.alive = True
        self.publications: dict[str, RosPublication] = {}
        self.subscriptions: dict[str, RosSubscription] = {}
        self._wanted: dict[tuple[str, str], None] = {}  # method, topic
        self._calls: deque[tuple[str, str]] = deque()  # those to come; the first is under way
        self._held: list[XmlRpcCall] = []  # updates
        self._met = False  # the master, at least once
        self._ended = False  # rospy, because it did not
        constants, context = processes.constants, processes.context
        started_ns = constants.poll_ns and int(context.stream(
            "ros", context.hosts[self.host], uri.life).integers(constants.start_ns + 1))
        self.xmlrpc_thread = XmlrpcThread(constants.poll_ns, context.now_ns - started_ns)
        self._links_up: dict[int, int] = {}  # links that are up, by publishing host
        processes.rpc.serve(self.host, uri.slave, self._serve)
        period_ns = processes.params.polling_ns
        if period_ns is not None and self.host != master:
            context.at(context.now_ns + int(context.stream(
                "ros", context.hosts[self.host], uri.life, "polling").integers(period_ns)),
                self.host, self._poll, period_ns)
        # The subscriber sends first.
        processes.tcp.listen(self.host, uri.tcpros, lambda connection: None)

    def stop(self) -> None:
        """End the process and all its links: the host stops."""
        self.alive = False
        for subscription in self.subscriptions.values():
            for link in subscription.links.values():
                link.drop()

    # Requests of its nodes.

    def publication(self, topic: str, transport: TransportKind) -> RosPublication:
        """The publication of ``topic``, whose first publisher wants ``transport``."""
        return self.publications.setdefault(topic, RosPublication(transport))

    def advertise(self, topic: str) -> None:
        self._register("registerPublisher", topic)

    def subscribe(self, end: Endpoint) -> bool:
        """Subscribe a node. Returns whether it did not subscribe before."""
        if end.topic not in self.subscriptions:
            self.subscriptions[end.topic] = RosSubscription()
            self._register("registerSubscriber", end.topic)
        ends = self.subscriptions[end.topic].ends
        if end in ends:
            return False
        ends.append(end)
        return True

    def subscribers(self, topic: str) -> list[Endpoint]:
        """The subscribers on this host, and the first subscriber on each host that a link leads to.
        """
        local = self.subscriptions.get(topic)
        linked = self.publications.get(topic)
        return [*(local.ends if local else ()), *(linked.ends.values() if linked else ())]

    # Registrations, in order. While a subscription is being registered, updates wait: they would be
    # newer than its answer (roscpp TopicManager holds subs_mutex_ meanwhile).

    def _register(self, method: str, topic: str) -> None:
        if self._ended or (method, topic) in self._wanted:
            return
        self._wanted[method, topic] = None
        asks = self.processes.constants.parameters if method == "registerSubscriber" else 0
        first = not self._calls
        self._calls.extend([("hasParam", topic)] * asks + [(method, topic)])
        if first:
            self._call()

    def _call(self, _: object = None) -> None:
        if not self.alive:
            return
        method, topic = self._calls[0]
        self.processes.rpc.call(self.host, self.master, "master", method, CALLS[method].call,
                          (method, topic, self.uri), self._registered)

    def _registered(self, ok: bool, answer: tuple[Uri, ...]) -> None:
        context, constants = self.processes.context, self.processes.constants
        if not ok and self.processes.params.client == "rospy" and not self._met:
            self._ended = True  # ROSInitException
            context.record("gave_up", self.host)
            return
        if not ok:
            context.at(context.now_ns + constants.master_retry_ns, self.host, self._call)
            return
        self._met = True
        method, topic = self._calls.popleft()
        if method == "registerSubscriber":
            self._publishers(topic, answer)
            held, self._held = self._held, []
            for call in held:
                self._serve(call)
        if self._calls:
            self._call()

    def _poll(self, period_ns: int) -> None:
        """Ask the master for all topics, and again when the period is over or the answer has come,
        whichever is later (ros::Rate)."""
        context = self.processes.context
        due_ns = context.now_ns + period_ns

        def answered(ok: bool, topics: object) -> None:
            context.at(max(due_ns, context.now_ns), self.host, self._poll, period_ns)

        if self.alive:
            self.processes.rpc.call(self.host, self.master, "master", "getPublishedTopics",
                              CALLS["getPublishedTopics"].call,
                              ("getPublishedTopics", self.processes.params.polled_topics,
                               self.master), answered)

    # Calls of others.

    def _serve(self, call: XmlRpcCall) -> None:
        self.xmlrpc_thread.event(self.processes.context.now_ns)
        method, *arguments = call.request
        if method == "requestTopic":
            call.reply(REQUEST_TOPIC[self.processes.params.client].answer,
                       self._requested(*arguments))
            return
        if method == "publisherUpdate":
            if self._calls and self._calls[0][0] == "registerSubscriber":
                self._held.append(call)
                return
            self._publishers(*arguments)
        if method == "getPublications":
            sizes = CALLS[method]
            call.reply(sizes.answer + sizes.answer_each * len(self.publications),
                       tuple(self.publications))
            return
        # A shutdown is for a process whose name another one has taken: none that runs, while a host
        # is one process.
        call.reply(CALLS[method].answer)

    def _requested(self, link: RosLink) -> TransportKind | None:
        """The transport of its topic, None: it is not published. UDPROS begins right away."""
        publication = self.publications.get(link.topic)
        if publication is None:
            return None
        if publication.transport == TransportKind.DATAGRAM:
            publication.links[link.process.host] = link
            self._serve_link(publication, link)
        return publication.transport

    def _publishers(self, topic: str, uris: tuple[Uri, ...]) -> None:
        """Take the publishers of ``topic`` from the master."""
        subscription = self.subscriptions[topic]
        links = subscription.links
        if uris == subscription.answer and all(link.asked for link in links.values()):
            return
        before = {uri.host: None for uri in subscription.answer if uri.host != self.host}
        subscription.answer = uris
        others = [uri for uri in uris if uri.host != self.host]
        after = {uri.host: None for uri in others}
        for host in before:
            if host not in after:
                self.processes.context.knows(self.host, host, topic, False)
        for host in after:
            self.processes.context.knows(self.host, host, topic, True)
        for uri, link in list(links.items()):
            if uri not in others and link.unlisted():
                del links[uri]
        for uri in others:
            if uri not in links:
                links[uri] = _LINKS[self.processes.params.client](self, topic, uri)
            link = links[uri]
            if not link.asked:
                link.ask()

    # Ends of links.

    def rests(self, link: RosLink) -> None:
        """At the subscriber: ``link`` rests until its publisher is listed once more."""
        subscription = self.subscriptions[link.topic]
        if link.uri not in subscription.answer:
            del subscription.links[link.uri]

    def linked(self, link: RosLink, by: Connection) -> None:
        """At the publisher: the header of a connection has arrived. Messages go to this subscriber
        over the connection that it opened last, which is the one that it listens to. The header of
        an earlier one may arrive later, where it had to be sent again."""
        if not link.process.alive:
            return  # its header was on its way when it died; its successor may be linked already
        publication = self.publications[link.topic]
        newest = publication.connections.get(link.process.host)
        if newest is None or newest.number < by.number:
            publication.connections[link.process.host] = by
            self._serve_link(publication, link)

    def _serve_link(self, publication: RosPublication, link: RosLink) -> None:
        host = link.process.host
        publication.ends[host] = link.process.subscriptions[link.topic].ends[0]
        self.processes.context.changed(link.topic)

    def unlinked(self, link: RosLink, by: Connection) -> None:
        """At the publisher: ``by`` is closed."""
        publication = self.publications[link.topic]
        host = link.process.host
        if publication.connections.get(host) is by:
            del publication.connections[host], publication.ends[host]
            self.processes.context.changed(link.topic)

    def count_links(self, publisher: int, more: int) -> None:
        """At the subscriber: ``more`` links from this host have opened, or closed."""
        count = self._links_up.get(publisher, 0) + more
        self._links_up[publisher] = count
        if self.processes.sees is not None and count == max(more, 0):
            self.processes.sees(self.host, publisher,
                                HostState.ONLINE if count else HostState.OFFLINE)
