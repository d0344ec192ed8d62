"""Where no Ray is, a sentence says so at once; one of our own needs no home."""

import os
import signal
import socket
import sys

import pytest

from pointshade_gl.batch.on_ray import connected, settings_of_local

pytestmark = pytest.mark.system


def test_without_ray_an_error_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with (
        pytest.raises(ValueError, match=r"^Ray is not installed: pip install '\.\[ray\]' in the clone$"),
        connected("local"),
    ):
        pass


@pytest.mark.parametrize("address", ["nonsense", "127.0.0.1:{port}", "ray://127.0.0.1:{port}", "127.0.0.1:99999", ""])
def test_where_no_cluster_answers_one_sentence_tells_it(address):
    pytest.importorskip("ray")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(OSError, match=r"^no Ray at [^\n]+$"), connected(address.format(port=port)):
        pass
    assert signal.getsignal(signal.SIGTERM) is before


@pytest.mark.parametrize(("home", "needs_token"), [("nowhere", True), (".", False)])
def test_a_local_ray_keeps_its_token_in_the_home_only_if_that_can_be_written(monkeypatch, tmp_path, home, needs_token):
    for name in ("RAY_AUTH_TOKEN", "RAY_USAGE_STATS_ENABLED"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / home))
    monkeypatch.setenv("USERPROFILE", str(tmp_path / home))
    before = dict(os.environ)
    with settings_of_local():
        assert ("RAY_AUTH_TOKEN" in os.environ) == needs_token
    assert dict(os.environ) == before
    monkeypatch.setenv("RAY_AUTH_TOKEN", "the user's")
    with settings_of_local():
        assert os.environ["RAY_AUTH_TOKEN"] == "the user's"
    assert os.environ["RAY_AUTH_TOKEN"] == "the user's"
