"""Views: moving scenes in the browser, and plots.

Nothing inside the library imports this package; meshcat and matplotlib are imported when something is drawn.
"""

from fivebar_pin.viz import plots
from fivebar_pin.viz.scene import Shown, html, page
from fivebar_pin.viz.server import Server, serve, view

__all__ = ["Server", "Shown", "html", "page", "plots", "serve", "view"]
