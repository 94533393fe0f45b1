"""The policy of desim's servers: for this machine alone, with deadlines, limits and an end.

A page of the web can reach a server of this machine: by a name that leads here (DNS rebinding; its
``Host`` gives it away), or by its address (its ``Origin`` does). Programs that are not browsers
send no ``Origin``, or one of a scheme of their own.
"""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Awaitable, Callable, Collection
from http import HTTPStatus
from types import TracebackType
from typing import NamedTuple
from urllib.parse import urlsplit

from desim.errors import InputError

HOST = "127.0.0.1"
MOST_CLIENTS = 32
REQUEST_S = 5.0  # for a client to send its request
STALLED_S = 20.0  # for a client to take what is sent to it
ENDING_S = 3.0  # after the end, for what is still being sent
_HERE = (HOST, "localhost")
_HEAD_BYTES = 16384


class Request(NamedTuple):
    """The head of a request of HTTP: its path, its headers by lower-case name, and its bytes."""

    path: str
    headers: dict[str, str]
    head: bytes


Answer = Callable[[Request, asyncio.StreamReader, asyncio.StreamWriter], Awaitable[object]]


class LocalServer:
    """Lets ``answer`` deal with requests to ``port`` (0: a free one), in a thread of its own. When
    the context ends, what is being answered has ``ENDING_S`` to end; all else is cut at once.

    ``sites``: the origins on the web that may ask, too. Raises ``InputError``, which names
    ``option``, where the port is taken.
    """

    def __init__(self, answer: Answer, option: str, port: int = 0,
                 sites: Collection[str] = ()) -> None:
        self._answer, self._sites = answer, sites
        try:
            self._socket = socket.create_server((HOST, port))
        except (OSError, OverflowError) as error:
            raise InputError(f"{option}: port {port} cannot be used: {error}") from None
        self.port: int = self._socket.getsockname()[1]
        self.loop = asyncio.new_event_loop()
        self._ended = asyncio.Event()
        self._clients: dict[asyncio.Task[None], None] = {}
        self._answering: set[asyncio.Task[None]] = set()
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def __enter__(self) -> LocalServer:
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.loop.call_soon_threadsafe(self._ended.set)
        self._thread.join()

    def _serve(self) -> None:
        self.loop.run_until_complete(self._until_end())
        self.loop.close()

    async def _until_end(self) -> None:
        server = await asyncio.start_server(self._client, sock=self._socket, limit=_HEAD_BYTES)
        await self._ended.wait()
        server.close()
        if self._answering:
            await asyncio.wait(self._answering, timeout=ENDING_S)
        for client in self._clients:
            client.cancel()
        await asyncio.gather(*self._clients, return_exceptions=True)

    async def _client(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._clients[task] = None
        try:
            await self._ask(task, reader, writer)
        except (OSError, TimeoutError, asyncio.IncompleteReadError, asyncio.LimitOverrunError,
                asyncio.CancelledError):
            pass  # it has gone, or must go
        finally:
            del self._clients[task]
            self._answering.discard(task)
            writer.transport.abort()

    async def _ask(self, task: asyncio.Task[None], reader: asyncio.StreamReader,
                   writer: asyncio.StreamWriter) -> None:
        if len(self._clients) > MOST_CLIENTS:
            await refuse(writer, HTTPStatus.SERVICE_UNAVAILABLE)
            return
        async with asyncio.timeout(REQUEST_S):
            head = await reader.readuntil(b"\r\n\r\n")
        self._answering.add(task)
        request = parsed(head)
        if request is None:
            await refuse(writer, HTTPStatus.BAD_REQUEST)
        elif not is_welcome(request.headers, self._sites):
            await refuse(writer, HTTPStatus.FORBIDDEN)
        else:
            await self._answer(request, reader, writer)


def parsed(head: bytes) -> Request | None:
    """The head of a GET request; None for anything else, and for a header that is there twice."""
    first, *lines = head.decode("latin-1").removesuffix("\r\n\r\n").split("\r\n")
    method, _, rest = first.partition(" ")
    pairs = [line.partition(":") for line in lines]
    headers = {name.lower(): value.strip() for name, _, value in pairs}
    if method != "GET" or not rest.endswith((" HTTP/1.1", " HTTP/1.0")) \
            or len(headers) < len(pairs):
        return None
    return Request(rest.rpartition(" ")[0], headers, head)


def is_welcome(headers: dict[str, str], sites: Collection[str] = ()) -> bool:
    """Whether a client has asked for this machine by name, and is no page of the web but those of
    ``sites``."""
    if _name(f"//{headers.get('host', '')}") not in _HERE:
        return False
    origin = headers.get("origin")
    if origin is None or origin in sites:
        return True
    is_web = origin == "null" or origin.startswith(("http:", "https:"))
    return not is_web or _name(origin) in _HERE


def _name(address: str) -> str | None:
    try:
        parts = urlsplit(address)
        return None if parts.username is not None or parts.path else parts.hostname
    except ValueError:
        return None


async def send(writer: asyncio.StreamWriter, data: bytes) -> None:
    """Send ``data``. Raises ``TimeoutError`` where the client takes none of it in time."""
    writer.write(data)
    async with asyncio.timeout(STALLED_S):
        await writer.drain()


async def begin(writer: asyncio.StreamWriter, content_type: str,
                status: HTTPStatus = HTTPStatus.OK) -> None:
    """Send the head of an answer, which ends with its connection."""
    lines = (f"HTTP/1.1 {status.value} {status.phrase}", f"Content-Type: {content_type}",
             "Cache-Control: no-store", "Connection: close", "", "")
    await send(writer, "\r\n".join(lines).encode())


async def end(writer: asyncio.StreamWriter) -> None:
    """Wait until the client has all that was sent."""
    writer.close()
    async with asyncio.timeout(STALLED_S):
        await writer.wait_closed()


async def refuse(writer: asyncio.StreamWriter, status: HTTPStatus) -> None:
    """Say why there is no answer."""
    await begin(writer, "text/plain", status)
    await send(writer, f"{status.phrase}\n".encode())
    await end(writer)
