"""The server of a running simulation: the page, and every chunk in order."""

from __future__ import annotations

import http.client
import urllib.request

import pytest

from desim.errors import InputError
from desim.report.live.server import ChunkLog, LiveServer


def read(url: str) -> str:
    with urllib.request.urlopen(url, timeout=10) as answer:
        return answer.read().decode()


def test_the_page_and_the_stream():
    log = ChunkLog()
    log.add("one")
    with LiveServer("<p>run</p>", log) as server:
        assert read(server.url) == "<p>run</p>"
        stream = urllib.request.urlopen(f"{server.url}stream", timeout=10)
        assert stream.readline() == b"data: one\n"
        log.add("two")
    assert stream.read() == b"\ndata: two\n\nevent: over\ndata:\n\n"


def test_a_late_listener_hears_all():
    log = ChunkLog()
    for chunk in ("one", "two"):
        log.add(chunk)
    log.close()
    assert list(log) == list(log) == ["one", "two"]


@pytest.mark.parametrize(("host", "path", "status"), [
    ("127.0.0.1:80", "/", 200), ("localhost:80", "/", 200), ("example.org:80", "/", 403),
    ("127.0.0.1:80", "/etc", 404)])
def test_only_this_machine_may_ask(host, path, status):
    log = ChunkLog()
    with LiveServer("page", log) as server:
        connection = http.client.HTTPConnection(server.url[7:-1], timeout=10)
        connection.request("GET", path, headers={"Host": host})
        assert connection.getresponse().status == status
        connection.close()


def test_a_port_that_is_taken():
    with LiveServer("page", ChunkLog()) as server:
        port = int(server.url.rstrip("/").rpartition(":")[2])
        with pytest.raises(InputError) as error:
            LiveServer("page", ChunkLog(), port)
    assert str(error.value).startswith(f"--live: port {port} cannot be used: ")
