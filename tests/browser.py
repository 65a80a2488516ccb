"""Headless Chromium for tests: the system's own, cut off from every network but this machine."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlparse

import pytest

_FLAGS = (
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
)


@dataclass
class Window:
    """An open page and what it said.

    Attributes:
        page: playwright's page.
        errors: console errors and uncaught exceptions.
        blocked: addresses it asked for outside of this machine.
    """

    page: Any
    errors: list[str] = field(default_factory=list)
    blocked: list[str] = field(default_factory=list)

    def open(self, url: str) -> None:
        """Open a page whose scene is complete when this returns."""
        self.page.goto(url, wait_until="load")
        self.until("typeof viewer === 'object' && viewer !== null && viewer.camera.fov === 16")

    def until(self, condition: str, *, seconds: float = 20.0) -> None:
        """Wait for a condition in the page; playwright's own way of waiting needs eval, which the page forbids."""
        end = time.monotonic() + seconds
        while not self._holds(condition):
            if time.monotonic() > end:
                pytest.fail(f"the page did not come to {condition} within {seconds} s; errors: {self.errors}")
            self.page.wait_for_timeout(20)

    def _holds(self, condition: str) -> bool:
        from playwright.sync_api import Error

        try:
            return bool(self.page.evaluate(f"() => {{ try {{ return {condition}; }} catch (e) {{ return false; }} }}"))
        except Error as error:
            if "Execution context was destroyed" in error.message:  # the page is being loaded anew
                return False
            raise

    def at(self, seconds: float) -> None:
        """Halt the animation at a playing time [s], picture drawn."""
        self.page.evaluate("t => { animator.pause(); animator.seek(t); animator.display_progress(t); }", seconds)
        self.page.evaluate("() => new Promise(r => requestAnimationFrame(() => requestAnimationFrame(r)))")

    def nodes(self) -> list[str]:
        """Return the paths of all groups of the scene."""
        return list(self.page.evaluate(_NODES))

    def place(self, path: str) -> list[float]:
        """Return the position of a node in its parent [m below /mechanisms]."""
        return list(self.page.evaluate(f"p => ({_FIND})(p).object.position.toArray()", path))

    def world(self, path: str) -> list[float]:
        """Return the position of a node on the stage [viewer units]."""
        world = f"({_FIND})(p).object.getWorldPosition(new MeshCat.THREE.Vector3()).toArray()"
        return list(self.page.evaluate(f"p => {{ viewer.scene.updateMatrixWorld(true); return {world}; }}", path))

    def line(self, path: str) -> list[list[float]]:
        """Return the points of a line (k, 3) as the page holds them."""
        script = f"p => Array.from(({_FIND})(p + '/<object>').object.geometry.attributes.position.array)"
        flat = self.page.evaluate(script, path)
        return [flat[k : k + 3] for k in range(0, len(flat), 3)]


_FIND = "p => viewer.scene_tree.find(p.split('/').filter((x) => x.length))"
_NODES = """() => {
  const out = [], walk = (node, path) => {
    for (const [name, child] of Object.entries(node.children)) {
      out.push(path + '/' + name); walk(child, path + '/' + name);
    }
  };
  walk(viewer.scene_tree, ''); return out;
}"""


@contextmanager
def chromium(*, width: int = 900, height: int = 520) -> Iterator[Window]:
    """Open headless Chromium with a software renderer; it fails the test where there is none."""
    from playwright.sync_api import sync_playwright

    program = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    if program is None:
        pytest.fail("Chromium is not installed: install the package 'chromium', or set CHROMIUM to its program")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=list(_FLAGS), headless=True)
        try:
            page = browser.new_context(viewport={"width": width, "height": height}).new_page()
            window = Window(page)
            page.on("console", lambda m: window.errors.append(m.text) if m.type == "error" else None)
            page.on("pageerror", lambda e: window.errors.append(str(e)))

            def guard(route: Any) -> None:
                parts = urlparse(route.request.url)
                if parts.scheme in {"file", "data", "blob"} or parts.hostname == "127.0.0.1":
                    route.continue_()
                else:
                    window.blocked.append(route.request.url)
                    route.abort()

            page.route("**/*", guard)
            yield window
        finally:
            browser.close()
