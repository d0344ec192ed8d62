"""Where no Ray is, a sentence says so at once."""

import signal
import socket
import sys

import pytest

from pointshade_gl.batch.cluster import connected

pytestmark = pytest.mark.system


def test_without_ray_an_error_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with (
        pytest.raises(ValueError, match=r"^Ray is not installed: pip install 'pointshade-gl\[ray\]'$"),
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
