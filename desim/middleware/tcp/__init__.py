"""TCP: what a reliable stream costs on the air and in time, and when it notices that it is cut.

One process per host: a connection is between two hosts. A segment is a range of bytes; data goes as
trains of segments, one frame each, which the medium loses or delivers as a whole.
"""

from desim.middleware.tcp.connection import Connection
from desim.middleware.tcp.parameters import TcpParams
from desim.middleware.tcp.stack import Tcp

__all__ = ["Connection", "Tcp", "TcpParams"]
