"""A live view: one scene served to browsers on this machine.

A page of another site may reach a server on this machine, too: by a name of its own that it lets point here (DNS
rebinding), or by sending requests across sites. Requests are therefore answered only when they name this server as a
browser does that was given its address, and when no other site is named as their origin.
"""

from __future__ import annotations

import contextlib
import ipaddress
import os
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable, Sequence
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import TracebackType
from typing import Any

from fivebar_pin._arrays import integer
from fivebar_pin.errors import OutputError
from fivebar_pin.viz.scene import Shown, page

__all__ = ["Server", "serve", "view"]

_PATIENCE = 10.0
"""How long a connection may be silent [s]; the page asks every second."""
_LOCAL = ("localhost", "127.0.0.1", "[::1]")
"""How a browser may name this machine."""


class Server:
    """A running view. Use it as a context, or call `close`.

    Attributes:
        url: the address to open in a browser.
        port: its port.
    """

    def __init__(self, text: str, *, host: str, port: int | None) -> None:
        self._body, self._version, self._host = text.encode("utf-8"), 1, host
        number = 0 if port is None else integer("port", port, least=0, most=65535)
        try:
            self._http = _Loopback((host, number), _handler(self))
        except (OSError, UnicodeError) as error:
            hint = "choose another port, or none to take a free one"
            reason = getattr(error, "strerror", None) or error
            raise OutputError(f"{host}:{port}", f"cannot be listened on ({reason}); {hint}") from error
        self.port = int(self._http.server_address[1])
        self.url = f"http://{host}:{self.port}/"
        self._thread = threading.Thread(target=self._http.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True)
        self._thread.start()

    def show(self, shown: Sequence[Shown], *, speed: float = 1.0, title: str = "") -> None:
        """Replace the scene; open browsers follow within a second."""
        self._body, self._version = page(shown, speed=speed, title=title, live=True).encode("utf-8"), self._version + 1

    def __str__(self) -> str:
        alone = self._host in _LOCAL
        reach = "It listens on this machine only." if alone else f"It listens on {self._host}, for whoever gets there."
        forward = f"From another machine: ssh -L {self.port}:127.0.0.1:{self.port} THIS_MACHINE, then the same address."
        return f"Live view at {self.url}\n  {reach}" + (f" {forward}" if alone else "")

    def welcomes(self, host: str | None, origin: str | None) -> bool:
        """Whether a request names this server (its header Host) and no other site as its origin.

        A server that listens for other machines is asked by number or by the name of its machine.
        """
        if host is None or origin not in (None, f"http://{host}"):
            return False
        name, _, port = host.lower().rpartition(":")
        if port != str(self.port):
            return False
        if name in _LOCAL or self._host in _LOCAL:
            return name in _LOCAL
        return name in (self._host.lower(), socket.gethostname().lower()) or _is_number(name)

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


def _is_number(name: str) -> bool:
    with contextlib.suppress(ValueError):
        return bool(ipaddress.ip_address(name.strip("[]")))
    return False


class _Loopback(ThreadingHTTPServer):
    daemon_threads = True
    # Another program's port must be refused, not shared.
    allow_reuse_address = True
    allow_reuse_port = False

    def handle_error(self, request: object, client_address: object) -> None:
        """Say nothing of a client that leaves in the middle of an answer."""
        if not isinstance(sys.exc_info()[1], OSError):
            super().handle_error(request, client_address)  # type: ignore[arg-type]


def _handler(server: Server) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        timeout = _PATIENCE

        def do_GET(self) -> None:
            if not server.welcomes(self.headers.get("Host"), self.headers.get("Origin")):
                self.send_error(HTTPStatus.FORBIDDEN, "Not for this name", f"Open {server.url} instead.")
                return
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
                ("Cross-Origin-Resource-Policy", "same-origin"),
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


def view(
    shown: Sequence[Shown],
    *,
    port: int | None = None,
    speed: float = 1.0,
    title: str = "",
    announce: Callable[[str], object] | None = None,
) -> None:
    """Serve a scene, open it in the browser where there is a screen, and block until the user interrupts (Ctrl-C).

    Args:
        shown: the mechanisms, from left to right.
        port: port to listen on; a free one unless given.
        speed: playing speed over real time [-].
        title: title of the page.
        announce: called with the address, how to reach it and how to stop it, before any browser opens: `print`, say.
    """
    try:
        with serve(shown, port=port, speed=speed, title=title) as server:
            if announce is not None:
                announce(f"{server}\n  Ctrl-C stops it.")
            if _has_screen():
                with contextlib.suppress(webbrowser.Error):
                    webbrowser.open(server.url)
            server.wait()
    except KeyboardInterrupt:
        return


def _has_screen() -> bool:
    """Whether a browser can open a window: on a terminal alone a text browser would take it over."""
    named = any(os.environ.get(word) for word in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"))
    return named or sys.platform in ("darwin", "win32")
