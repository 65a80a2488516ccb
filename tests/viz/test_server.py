"""The live view: on this machine only, closed when told, clear about ports."""

from __future__ import annotations

import http.client
import io
import socket
import struct
import time
import urllib.error
import urllib.request

import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin import viz
from fivebar_pin.cli import main
from fivebar_pin.errors import InvalidInputError, OutputError
from fivebar_pin.viz import server as live


@pytest.fixture(scope="module")
def shown() -> list[viz.Shown]:
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "hinge")
    model.appendBodyToJoint(joint, pin.Inertia(1.0, np.array([0.2, 0.0, 0.0]), np.eye(3) * 0.01), pin.SE3.Identity())
    return [viz.Shown.at(fb.ClosedChain(model, (), ("hinge",), name="pendulum"), [0.3])]


def get(url: str) -> str:
    with urllib.request.urlopen(url, timeout=5) as answer:
        return str(answer.read().decode("utf-8"))


def test_server_listens_on_loopback_alone(shown: list[viz.Shown]) -> None:
    """The same port on another address of this machine is still free to listen on."""
    with viz.serve(shown) as server:
        assert server.url.startswith("http://127.0.0.1:")
        port = int(server.url.rstrip("/").rsplit(":", 1)[1])
        with socket.socket() as other:
            other.bind(("127.0.0.2", port))
        assert "pendulum" in get(server.url)


def test_server_answers_nothing_but_its_page(shown: list[viz.Shown]) -> None:
    """Paths that do not exist are not found, however they are written."""
    with viz.serve(shown) as server:
        for path in ("etc/passwd", "../../etc/passwd", "page.html"):
            with pytest.raises(urllib.error.HTTPError) as caught:
                get(server.url + path)
            assert caught.value.code == 404
            caught.value.close()


def test_closed_server_is_gone(shown: list[viz.Shown]) -> None:
    """After close nothing answers, and the port can be used again; closing twice is harmless."""
    server = viz.serve(shown)
    server.close()
    server.close()
    with pytest.raises(urllib.error.URLError):
        get(server.url)
    port = int(server.url.rstrip("/").rsplit(":", 1)[1])
    viz.serve(shown, port=port).close()


def test_port_in_use_is_named(shown: list[viz.Shown]) -> None:
    """A port that is taken is an error that says which and what to do."""
    with viz.serve(shown) as server:
        port = int(server.url.rstrip("/").rsplit(":", 1)[1])
        with pytest.raises(OutputError, match=rf"127\.0\.0\.1:{port}.*another port"):
            viz.serve(shown, port=port)


def test_port_out_of_range_is_refused(shown: list[viz.Shown]) -> None:
    """A port that cannot exist is refused with its bounds."""
    with pytest.raises(InvalidInputError, match="65535"):
        viz.serve(shown, port=70000)


def test_view_opens_the_browser_and_ends_with_an_interrupt(
    shown: list[viz.Shown], monkeypatch: pytest.MonkeyPatch
) -> None:
    """`view` opens the page, blocks, and returns when interrupted; nothing listens afterwards."""
    opened: list[str] = []

    def interrupt(self: viz.Server) -> None:
        assert "pendulum" in get(self.url)
        raise KeyboardInterrupt

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr(viz.Server, "wait", interrupt)
    viz.view(shown)
    assert len(opened) == 1
    with pytest.raises(urllib.error.URLError):
        get(opened[0])


def asked(server: viz.Server, headers: dict[str, str], path: str = "/") -> int:
    """Return the status of a request with exactly these headers."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=5)
    connection.putrequest("GET", path, skip_host=True)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    assert answer.status == 200 or b"pendulum" not in body
    return answer.status


def test_only_who_names_this_server_is_answered(shown: list[viz.Shown]) -> None:
    """A page of another site that lets its own name point to this machine (DNS rebinding) reads nothing."""
    with viz.serve(shown) as server:
        port = server.port
        for name in ("127.0.0.1", "localhost", "LOCALHOST", "[::1]"):
            assert asked(server, {"Host": f"{name}:{port}"}) == 200
            assert asked(server, {"Host": f"{name}:{port}", "Origin": f"http://{name}:{port}"}, "/version") == 200
        for host in (
            f"evil.example:{port}", "evil.example", "127.0.0.1", f"127.0.0.1:{port + 1}",
            f"localhost.evil.example:{port}",
            f"127.0.0.1.evil.example:{port}", f"10.0.0.1:{port}", "", f":{port}", "[::1",
        ):  # fmt: skip
            assert asked(server, {"Host": host}) == 403, host
            assert asked(server, {"Host": host}, "/version") == 403, host
        assert asked(server, {}) == 403
        for origin in ("http://evil.example", "null", f"https://127.0.0.1:{port}", f"http://127.0.0.1:{port + 1}"):
            assert asked(server, {"Host": f"127.0.0.1:{port}", "Origin": origin}) == 403, origin


def test_a_server_for_other_machines_is_asked_by_number_or_its_own_name(shown: list[viz.Shown]) -> None:
    with viz.serve(shown, host="0.0.0.0") as server:
        for name in ("127.0.0.1", "192.0.2.7", "[2001:db8::1]", socket.gethostname()):
            assert server.welcomes(f"{name}:{server.port}", None), name
        assert not server.welcomes(f"evil.example:{server.port}", None)
        assert "for whoever gets there" in str(server)


def test_a_silent_connection_is_closed(shown: list[viz.Shown], monkeypatch: pytest.MonkeyPatch) -> None:
    """It would hold a thread for ever."""
    monkeypatch.setattr(live, "_PATIENCE", 0.2)
    with viz.serve(shown) as server, socket.create_connection(("127.0.0.1", server.port), timeout=5) as silent:
        silent.sendall(b"GET / HTT")
        started = time.monotonic()
        assert silent.recv(100) == b""
        assert time.monotonic() - started < 4.0


def test_a_client_that_leaves_is_not_worth_a_word(shown: list[viz.Shown], capfd: pytest.CaptureFixture[str]) -> None:
    """Connections that are cut in the middle of a request or an answer."""
    with viz.serve(shown) as server:
        request = f"GET / HTTP/1.0\r\nHost: 127.0.0.1:{server.port}\r\n\r\n".encode()
        for sent in (b"", b"GET", request, request):
            cut = socket.create_connection(("127.0.0.1", server.port), timeout=5)
            cut.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            cut.sendall(sent)
            cut.close()
        assert "pendulum" in get(server.url)
        time.sleep(0.2)
    assert capfd.readouterr() == ("", "")


def test_view_tells_the_address_at_once_and_how_to_stop_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before any browser opens: on a machine reached by SSH there is none, and nothing else tells where the page is."""
    said: list[str] = []

    def opened(url: str) -> None:
        said.append(capsys.readouterr().out)
        assert url in said[0]

    def interrupt(self: viz.Server) -> None:
        raise KeyboardInterrupt

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr("webbrowser.open", opened)
    monkeypatch.setattr(viz.Server, "wait", interrupt)
    assert main(["view", "four_bar_crank_rocker"]) == 0
    for words in ("http://127.0.0.1:", "this machine only", "ssh -L", "Ctrl-C stops it"):
        assert words in said[0]


def test_no_browser_opens_without_a_screen(shown: list[viz.Shown], monkeypatch: pytest.MonkeyPatch) -> None:
    """A text browser would take the terminal; a library call says nothing unless told where to."""

    def interrupt(self: viz.Server) -> None:
        raise KeyboardInterrupt

    def refuse(url: str) -> None:
        raise AssertionError(url)

    for word in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(word, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setattr("webbrowser.open", refuse)
    monkeypatch.setattr(viz.Server, "wait", interrupt)
    text = io.StringIO()
    viz.view(shown, announce=text.write)
    assert "http://127.0.0.1:" in text.getvalue()
