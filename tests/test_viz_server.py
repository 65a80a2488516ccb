"""The live view: on this machine only, closed when told, clear about ports."""

from __future__ import annotations

import socket
import urllib.error
import urllib.request

import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin import viz
from fivebar_pin.errors import InvalidInputError, OutputError


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

    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr(viz.Server, "wait", interrupt)
    viz.view(shown)
    assert len(opened) == 1
    with pytest.raises(urllib.error.URLError):
        get(opened[0])
