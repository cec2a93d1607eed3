"""Serves the explorer of docs/explorer to the browsers of this machine."""

from __future__ import annotations

from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from agents.files import ROOT, ConfigError

FOLDER = ROOT / "docs" / "explorer"


class _Handler(SimpleHTTPRequestHandler):
    extensions_map = {  # noqa: RUF012 (as the base class has it)
        **SimpleHTTPRequestHandler.extensions_map,
        ".js": "text/javascript",
        ".gz": "application/octet-stream",  # unpacked by the page itself
    }

    def end_headers(self) -> None:
        """Let the browser ask again: the files change as one works on them."""
        self.send_header("Cache-Control", "no-cache")
        super().end_headers()

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing."""


def make_server(port: int) -> ThreadingHTTPServer:
    """Return a server of the explorer on this machine's own address; ``serve_forever`` runs it.

    Parameters
    ----------
    port : int
        0 takes a free one; ``server_port`` says which.

    Raises
    ------
    ConfigError
        If the port is taken, or not allowed.
    """
    if not 0 <= port <= 65_535:
        raise ConfigError(f"--port must be 0 to 65535, got {port}")
    try:
        return ThreadingHTTPServer(("127.0.0.1", port), partial(_Handler, directory=str(FOLDER)))
    except OSError as error:
        raise ConfigError(
            f"port {port} cannot be used ({error}); choose another by --port"
        ) from None
