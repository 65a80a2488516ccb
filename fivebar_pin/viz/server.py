"""A live view: one scene served to browsers on this machine."""

from __future__ import annotations

import threading
import webbrowser
from collections.abc import Sequence
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import TracebackType
from typing import Any

from fivebar_pin.errors import InvalidInputError, OutputError
from fivebar_pin.viz.scene import Shown, page

__all__ = ["Server", "serve", "view"]


class Server:
    """A running view. Use it as a context, or call `close`.

    Attributes:
        url: the address to open in a browser.
    """

    def __init__(self, text: str, *, host: str, port: int | None) -> None:
        self._body, self._version = text.encode("utf-8"), 1
        try:
            self._http = _Loopback((host, port or 0), _handler(self))
        except OverflowError as error:
            raise InvalidInputError("port", port, "must lie between 0 and 65535") from error
        except OSError as error:
            hint = "choose another port, or none to take a free one"
            raise OutputError(f"{host}:{port}", f"cannot be listened on ({error.strerror or error}); {hint}") from error
        self.url = f"http://{host}:{self._http.server_address[1]}/"
        self._thread = threading.Thread(target=self._http.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True)
        self._thread.start()

    def show(self, shown: Sequence[Shown], *, speed: float = 1.0, title: str = "") -> None:
        """Replace the scene; open browsers follow within a second."""
        self._body, self._version = page(shown, speed=speed, title=title, live=True).encode("utf-8"), self._version + 1

    def answer(self, path: str) -> tuple[bytes, str] | None:
        """Return body and content type for a path, None where there is nothing."""
        if path.split("?")[0] in {"/", "/index.html"}:
            return self._body, "text/html; charset=utf-8"
        if path.split("?")[0] == "/version":
            return str(self._version).encode("ascii"), "text/plain; charset=utf-8"
        if path == "/favicon.ico":
            return b"", "image/x-icon"
        return None

    def wait(self) -> None:
        """Block until the server is closed or the user interrupts."""
        while self._thread.is_alive():
            self._thread.join(0.5)

    def close(self) -> None:
        """Stop listening; calling it twice does no harm."""
        self._http.shutdown()
        self._http.server_close()
        self._thread.join()

    def __enter__(self) -> Server:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class _Loopback(ThreadingHTTPServer):
    daemon_threads = True
    # Another program's port must be refused, not shared.
    allow_reuse_address = True
    allow_reuse_port = False


def _handler(server: Server) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            found = server.answer(self.path)
            if found is None:
                self.send_error(HTTPStatus.NOT_FOUND)
                return
            body, kind = found
            self.send_response(HTTPStatus.OK)
            for key, value in (
                ("Content-Type", kind),
                ("Content-Length", str(len(body))),
                ("Cache-Control", "no-store"),
            ):
                self.send_header(key, value)
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, format: str, *args: Any) -> None:
            """Stay silent: the library does not print."""

    return Handler


def serve(
    shown: Sequence[Shown],
    *,
    port: int | None = None,
    host: str = "127.0.0.1",
    speed: float = 1.0,
    title: str = "",
) -> Server:
    """Serve a scene from a thread of its own and return at once.

    Args:
        shown: the mechanisms, from left to right.
        port: port to listen on; a free one unless given.
        host: address to listen on. The default is reachable from this machine alone.
        speed: playing speed over real time [-].
        title: title of the page.

    Raises:
        OutputError: the port is in use or the address is not this machine's.
        InvalidInputError: nothing to show, or a value that does not fit.
    """
    return Server(page(shown, speed=speed, title=title, live=True), host=host, port=port)


def view(shown: Sequence[Shown], *, port: int | None = None, speed: float = 1.0, title: str = "") -> None:
    """Serve a scene, open it in the browser, and block until the user interrupts (Ctrl-C)."""
    with serve(shown, port=port, speed=speed, title=title) as server:
        webbrowser.open(server.url)
        try:
            server.wait()
        except KeyboardInterrupt:
            return
