"""The subscriber's end of a link as rospy makes it, which differs where something fails."""

from __future__ import annotations

from desim.middleware.ros1.links import RosLink
from desim.middleware.ros1.parameters import UNREACHED
from desim.middleware.ros1.sizes import CALLS
from desim.middleware.tcp import Connection


class RospyLink(RosLink):
    """A link of rospy 1.15.15. It repeats requestTopic although the master no longer lists the
    publisher (registration.py, run), and does not open a connection again that breaks
    (tcpros_base.py, recv_buff, receive_loop).

    Where the publisher was not reached, rospy asks it once, later, whether it still publishes the
    topic (tcpros_pubsub.py, robust_connect_subscriber). If so, it reads from the old socket, to
    which it has not written the header: it learns that this has failed, or, where TCP still
    connects, waits for nothing until it ends. If not, it never removes the connection from its
    list, and does not make another one to this address (``stuck``)."""

    stuck = False
    _open = False
    _late = False  # the connection took too long
    _reads = False  # from a connection that took too long

    def unlisted(self) -> bool:
        """Nothing changes, but for UDPROS, which rospy does not have."""
        if self.up and self._connection is None:
            return super().unlisted()
        return False

    def _connect(self, _: object) -> None:
        self._open = self._late = self._reads = False
        super()._connect(_)

    def _opened(self, connection: Connection) -> None:
        if not self._late:
            self._open = True
            super()._opened(connection)

    def _hang_up(self, _: object) -> None:
        """Leave a connection that takes too long to itself."""
        self._late = True
        self._check_soon()

    def _broke(self, reason: str) -> None:
        if self._late:
            if self._reads:
                self._rest()
            return
        self._cancel_timer()
        if self._open or reason not in UNREACHED:
            self._rest()
        else:
            self._check_soon()

    def _check_soon(self) -> None:
        processes = self.process.processes
        self._set_timer(processes.context.now_ns + processes.constants.reconnect_first_ns,
                        self._check)

    def _check(self, _: object) -> None:
        """Ask the publisher for its topics (check_if_still_publisher)."""
        processes = self.process.processes
        self._call = processes.rpc.call(
            self.process.host, self.uri.host, self.uri.slave, "getPublications",
            CALLS["getPublications"].call, ("getPublications",), self._checked,
            timeout_ns=processes.constants.connect_timeout_ns, fresh=True)

    def _checked(self, ok: bool, topics: tuple[str, ...] | None) -> None:
        if self._dropped:
            return
        if not ok or self.topic not in (topics or ()):
            self.stuck = True
        elif self._connection is None:
            self._rest()
        else:
            self._reads = True
