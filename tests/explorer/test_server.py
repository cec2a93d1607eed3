"""`train.py explore` serves the explorer to this machine alone."""

import threading
import urllib.error
import urllib.request

import pytest

from agents.explorer import make_server
from agents.files import ConfigError


@pytest.fixture
def server():
    with make_server(0) as made:
        threading.Thread(target=made.serve_forever, daemon=True).start()
        yield made
        made.shutdown()


def answer(server, path):
    return urllib.request.urlopen(f"http://127.0.0.1:{server.server_port}/{path}", timeout=10)


def test_pages_modules_and_the_packed_simulator_come_as_what_they_are(server):
    for path, kind in (
        ("", "text/html"),
        ("src/main.js", "text/javascript"),
        ("data/robots.json", "application/json"),
        ("vendor/mujoco.wasm.gz", "application/octet-stream"),
    ):
        with answer(server, path) as found:
            assert found.headers.get_content_type() == kind
            assert found.headers["Content-Encoding"] is None
    with pytest.raises(urllib.error.HTTPError, match="404"):
        answer(server, "../../train.py")


def test_only_this_machine_is_served(server):
    assert server.server_address[0] == "127.0.0.1"


def test_a_port_that_is_taken_or_impossible_is_said(server):
    with pytest.raises(ConfigError, match=r"port \d+ cannot be used .*choose another by --port"):
        make_server(server.server_port)
    with pytest.raises(ConfigError, match="--port must be 0 to 65535, got 70000"):
        make_server(70_000)
