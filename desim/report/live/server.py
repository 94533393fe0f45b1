"""A web server for one page and a stream of chunks, for browsers on this machine alone."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from http import HTTPStatus
from types import TracebackType

from desim.report.live.policy import HOST, LocalServer, Request, begin, end, refuse, send

_STREAM, _PAGE = "/stream", "/"
_OVER = "event: over\ndata:\n\n"


class ChunkLog:
    """Chunks of text in order: a reader that comes late gets those before, too. ``on_news`` is
    called after each one and at the end, in the thread that adds them."""

    def __init__(self) -> None:
        self.chunks: list[str] = []
        self.is_over = False
        self.on_news: Callable[[], object] = lambda: None

    def add(self, chunk: str) -> None:
        """Add a chunk: one line of text."""
        self.chunks.append(chunk)
        self.on_news()

    def close(self) -> None:
        """No more chunks will come."""
        self.is_over = True
        self.on_news()


class LiveServer:
    """Serves ``page`` (HTML) at ``url``, and the chunks of ``log`` as server-sent events at
    ``/stream`` beside it, until the context ends: then browsers that listen get the last chunk.

    ``port`` 0 takes a free one. Raises ``InputError`` where the port is taken.
    """

    def __init__(self, page: str, log: ChunkLog, port: int = 0) -> None:
        self._server = LocalServer(self._answer, "--live", port)
        self._page, self._log, self._news = page.encode(), log, asyncio.Event()
        log.on_news = self._notify

    @property
    def url(self) -> str:
        """The address of the page."""
        return f"http://{HOST}:{self._server.port}/"

    def __enter__(self) -> LiveServer:
        self._server.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self._log.close()
        self._log.on_news = lambda: None
        self._server.__exit__(kind, error, trace)

    def _notify(self) -> None:
        self._server.loop.call_soon_threadsafe(self._ring)

    def _ring(self) -> None:
        self._news.set()
        self._news = asyncio.Event()

    async def _answer(self, request: Request, _: asyncio.StreamReader,
                      writer: asyncio.StreamWriter) -> None:
        if request.path == _PAGE:
            await begin(writer, "text/html; charset=utf-8")
            await send(writer, self._page)
        elif request.path == _STREAM:
            await begin(writer, "text/event-stream")
            await self._stream(writer)
        else:
            await refuse(writer, HTTPStatus.NOT_FOUND)
            return
        await end(writer)

    async def _stream(self, writer: asyncio.StreamWriter) -> None:
        log, number = self._log, 0
        while True:
            news = self._news  # before the look: what comes after it rings this one
            if number < len(log.chunks):
                await send(writer, f"data: {log.chunks[number]}\n\n".encode())
                number += 1
            elif log.is_over:
                break
            else:
                await news.wait()
        await send(writer, _OVER.encode())
