"""TCP: what a reliable stream costs in bytes and time, and when it notices that the link is cut.

One process per host, so a connection is between two hosts. Data goes in *trains*: consecutive
segments that the network carries as one frame and may lose in part.
"""

from desim.middleware.tcp.connection import Connection, StreamMessage
from desim.middleware.tcp.parameters import TcpParams
from desim.middleware.tcp.stack import Tcp

__all__ = ["Connection", "StreamMessage", "Tcp", "TcpParams"]
