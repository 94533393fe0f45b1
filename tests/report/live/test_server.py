"""The server of a running simulation: who may ask, every chunk in order, and an end in any case."""

from __future__ import annotations

import http.client
import socket
import urllib.request

import pytest

from desim.errors import InputError
from desim.report.live import policy
from desim.report.live.server import ChunkLog, LiveServer


def read(url: str) -> str:
    with urllib.request.urlopen(url, timeout=10) as answer:
        return answer.read().decode()


def filled(*chunks: str) -> ChunkLog:
    log = ChunkLog()
    for chunk in chunks:
        log.add(chunk)
    return log


def dialled(server: LiveServer, data: bytes = b"") -> socket.socket:
    port = int(server.url.rstrip("/").rpartition(":")[2])
    client = socket.create_connection(("127.0.0.1", port), timeout=10)
    client.sendall(data)
    return client


STREAM = b"GET /stream HTTP/1.1\r\nHost: localhost\r\n\r\n"


def test_the_page_and_the_stream():
    log = filled("one")
    with LiveServer("<p>run</p>", log) as server:
        assert read(server.url) == "<p>run</p>"
        stream = urllib.request.urlopen(f"{server.url}stream", timeout=10)
        assert stream.readline() == b"data: one\n"
        log.add("two")
    assert stream.read() == b"\ndata: two\n\nevent: over\ndata:\n\n"


def test_a_late_listener_hears_all_and_the_page_stays():
    log = filled("one", "two")
    log.close()
    with LiveServer("<p>run</p>", log) as server:
        whole = "data: one\n\ndata: two\n\nevent: over\ndata:\n\n"
        assert read(f"{server.url}stream") == read(f"{server.url}stream") == whole
        assert read(server.url) == "<p>run</p>"


@pytest.mark.parametrize(("headers", "path", "status"), [
    ({"Host": "127.0.0.1:80"}, "/", 200), ({"Host": "localhost:80"}, "/", 200),
    ({"Host": "localhost"}, "/", 200), ({"Host": "example.org:80"}, "/", 403),
    ({"Host": "localhost.example.org"}, "/", 403), ({"Host": "x@localhost"}, "/", 403),
    ({"Host": ""}, "/", 403), ({"Host": "[::1"}, "/", 403),
    ({"Host": "localhost", "Origin": "http://localhost:80"}, "/stream", 200),
    ({"Host": "localhost", "Origin": "https://example.org"}, "/", 403),
    ({"Host": "localhost", "Origin": "http://localhost.example.org"}, "/stream", 403),
    ({"Host": "localhost", "Origin": "null"}, "/stream", 403),
    ({"Host": "localhost", "Origin": "https://app.foxglove.dev"}, "/", 403),
    ({"Host": "127.0.0.1:80"}, "/etc", 404)])
def test_only_this_machine_may_ask(headers, path, status):
    log = filled("one")
    log.close()
    with LiveServer("page", log) as server:
        connection = http.client.HTTPConnection(server.url[7:-1], timeout=10)
        connection.request("GET", path, headers=headers)
        assert connection.getresponse().status == status
        connection.close()


@pytest.mark.parametrize("head", [
    b"POST / HTTP/1.1\r\nHost: localhost\r\n\r\n", b"GET /\r\n\r\n", b"\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: localhost\r\nhost: example.org\r\n\r\n",
    b"GET / HTTP/1.1\r\n\xff\r\n: \r\n\r\n"])
def test_what_is_no_request_is_refused(head):
    with LiveServer("page", ChunkLog()) as server, dialled(server, head) as client:
        assert client.recv(12) in (b"HTTP/1.1 400", b"HTTP/1.1 403")


def test_sites_and_programs():
    """Foxglove in a browser, its desktop program (of another scheme), a script."""
    site, here = "https://app.foxglove.dev", {"host": "localhost:8765"}
    assert policy.is_welcome({**here, "origin": site}, (site,))
    assert policy.is_welcome({**here, "origin": "file://"}, (site,))
    assert policy.is_welcome(here, (site,))
    assert not policy.is_welcome({**here, "origin": "https://app.foxglove.dev.example"}, (site,))
    assert not policy.is_welcome({"host": "example.org", "origin": site}, (site,))


def test_it_ends_although_clients_dawdle(monkeypatch):
    """One connects and says nothing, one begins a request, one reads nothing of 40 MB."""
    monkeypatch.setattr(policy, "ENDING_S", 0.05)
    log = filled("x" * 40_000_000)
    with LiveServer("page", log) as server:
        clients = [dialled(server), dialled(server, b"GET / HT"), dialled(server, STREAM)]
        assert clients[2].recv(8) == b"HTTP/1.1"
    for client in clients[:2]:
        with client:
            assert client.recv(1) == b""
    clients[2].close()


def test_one_who_still_reads_gets_all():
    """The twin."""
    log = filled("x" * 4_000_000)
    with LiveServer("page", log) as server:
        stream = urllib.request.urlopen(f"{server.url}stream", timeout=10)
        log.close()
        assert len(stream.read()) == 4_000_000 + len("data: \n\nevent: over\ndata:\n\n")


@pytest.mark.parametrize("data", [b"", b"GET / HT"])
def test_a_client_that_asks_nothing_is_cut(monkeypatch, data):
    monkeypatch.setattr(policy, "REQUEST_S", 0.05)
    with LiveServer("page", ChunkLog()) as server, dialled(server, data) as client:
        assert client.recv(1) == b""


def test_a_client_that_takes_nothing_is_cut(monkeypatch):
    """Without that the server would wait for it for 11 days."""
    monkeypatch.setattr(policy, "ENDING_S", 1e6)
    monkeypatch.setattr(policy, "STALLED_S", 0.05)
    with LiveServer("page", filled("x" * 40_000_000)) as server:
        client = dialled(server, STREAM)
        assert client.recv(8) == b"HTTP/1.1"
    client.close()


def test_more_clients_than_allowed_are_turned_away(monkeypatch):
    monkeypatch.setattr(policy, "MOST_CLIENTS", 2)
    with LiveServer("page", filled("one")) as server:
        first, second = dialled(server, STREAM), dialled(server, STREAM)
        assert first.recv(8) == second.recv(8) == b"HTTP/1.1"
        with dialled(server, STREAM) as third:
            assert third.recv(12) == b"HTTP/1.1 503"
    first.close()
    second.close()


def test_a_port_that_is_taken():
    with LiveServer("page", ChunkLog()) as server:
        port = int(server.url.rstrip("/").rpartition(":")[2])
        with pytest.raises(InputError) as error:
            LiveServer("page", ChunkLog(), port)
    assert str(error.value).startswith(f"--live: port {port} cannot be used: ")
