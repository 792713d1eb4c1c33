"""Pages for a browser on this computer: their server, and what they share in look and script."""

from cdprcal.local_page.server import Action, LocalServer, Messages

__all__ = ["Action", "LocalServer", "Messages"]
