"""A web server for one page and a stream of chunks, for browsers on this machine alone."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import count
from types import TracebackType

from desim.errors import InputError

_HOST = "127.0.0.1"
_STREAM, _PAGE = "/stream", "/"
_OVER = "event: over\ndata:\n\n"


class ChunkLog:
    """Chunks of text in order. A reader that comes late gets those before, too."""

    def __init__(self) -> None:
        self._chunks: list[str] = []
        self._over = False
        self._news = threading.Condition()

    def add(self, chunk: str) -> None:
        """Add a chunk: one line of text."""
        with self._news:
            self._chunks.append(chunk)
            self._news.notify_all()

    def close(self) -> None:
        """No more chunks will come."""
        with self._news:
            self._over = True
            self._news.notify_all()

    def __iter__(self) -> Iterator[str]:
        """All chunks; waits for the next one until the log is closed."""
        for number in count():
            with self._news:
                while len(self._chunks) == number and not self._over:
                    self._news.wait()
                if len(self._chunks) == number:
                    return
                chunk = self._chunks[number]
            yield chunk


class LiveServer:
    """Serves ``page`` (HTML) at ``url``, and the chunks of ``log`` as server-sent events at
    ``/stream`` beside it, until the context ends and all browsers have the last chunk.

    ``port`` 0 takes a free one. Raises ``InputError`` where the port is taken.
    """

    def __init__(self, page: str, log: ChunkLog, port: int = 0) -> None:
        handler = type("Handler", (_Handler,), {"page": page.encode(), "log": log})
        try:
            self._server = ThreadingHTTPServer((_HOST, port), handler)
        except (OSError, OverflowError) as error:
            raise InputError(f"--live: port {port} cannot be used: {error}") from None
        self._server.daemon_threads = False  # closing waits for what is being sent
        self._log = log
        self._thread = threading.Thread(target=self._server.serve_forever)

    @property
    def url(self) -> str:
        """The address of the page."""
        return f"http://{_HOST}:{self._server.server_port}/"

    def __enter__(self) -> LiveServer:
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self._log.close()
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()


class _Handler(BaseHTTPRequestHandler):
    """Answers one request; ``page`` and ``log`` are its server's."""

    page: bytes
    log: ChunkLog
    timeout = 30.0  # for a browser that reads no more

    def do_GET(self) -> None:
        """Send the page, or the stream."""
        # A page of the web whose name leads here must not read the run (DNS rebinding).
        if self.headers.get("Host", "").rpartition(":")[0] not in (_HOST, "localhost"):
            self.send_error(HTTPStatus.FORBIDDEN)
        elif self.path == _PAGE:
            self._begin("text/html; charset=utf-8")
            self.wfile.write(self.page)
        elif self.path == _STREAM:
            self._begin("text/event-stream")
            for chunk in self.log:
                self.wfile.write(f"data: {chunk}\n\n".encode())
            self.wfile.write(_OVER.encode())
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def _begin(self, content_type: str) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", content_type)
        self.send_header("Cache-Control", "no-store")
        self.end_headers()

    def handle(self) -> None:
        """Answer, unless the browser has gone."""
        try:
            super().handle()
        except (ConnectionError, TimeoutError):
            self.close_connection = True

    def log_message(self, *_: object) -> None:
        """Say nothing."""
