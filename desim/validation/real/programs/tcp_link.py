"""One end of a TCP connection.

    tcp_link.py hear PORT
    tcp_link.py talk HOST PORT BYTES EVERY_S SECONDS NODELAY

A talker connects at once, and talks from one second later on: a message every EVERY_S, or (0)
always the next one. Both print their first instant, and the other one each message: its number,
when it came, when it was sent. Ten seconds after its last message a talker prints what it sent
again.
"""

import signal
import socket
import struct
import sys
import time

HEADER = struct.Struct("<IId")
RETRANSMITTED = 100  # offset of tcpi_total_retrans in struct tcp_info


def hear(port):
    server = socket.socket()
    server.bind(("", port))
    server.listen()
    stream = server.accept()[0].makefile("rb")
    while header := stream.read(HEADER.size):
        size, number, born = HEADER.unpack(header)
        stream.read(size - HEADER.size)
        sys.stdout.write(f"heard {number} {time.time():.9f} {born:.9f}\n")


def talk(host, port, size, every, seconds, nodelay):
    connection = socket.create_connection((host, port))
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, nodelay)
    begin = began + 1
    time.sleep(max(begin - time.time(), 0))
    number = 0
    while (now := time.time()) < begin + seconds:
        connection.sendall(HEADER.pack(size, number, now) + bytes(size - HEADER.size))
        number += 1
        if every:
            time.sleep(max(begin + number * every - time.time(), 0))
    time.sleep(10)
    info = connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 104)
    sys.stdout.write(f"again {struct.unpack_from('<I', info, RETRANSMITTED)[0]}\n")
    signal.pause()


began = time.time()
sys.stdout.write(f"began {began:.9f}\n")
if sys.argv[1] == "hear":
    hear(int(sys.argv[2]))
else:
    talk(sys.argv[2], int(sys.argv[3]), int(sys.argv[4]), float(sys.argv[5]), float(sys.argv[6]),
         int(sys.argv[7]))
