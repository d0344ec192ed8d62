"""What tests start ends with them, and hears signals also where the run ignores them."""

import signal
import subprocess
import sys

import pytest

from .children import default_signals, started

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
END_ITSELF = "import os, signal; os.kill(os.getpid(), signal.{}); print('alive')"


@pytest.mark.parametrize("name", ["SIGHUP", "SIGTERM"])
def test_a_signal_that_this_process_ignores_ends_its_children(name):
    ending, code = getattr(signal, name), END_ITSELF.format(name)

    def end_itself():
        return subprocess.run([sys.executable, "-S", "-c", code], capture_output=True, text=True, timeout=60)

    before = signal.signal(ending, signal.SIG_IGN)
    try:
        assert end_itself().stdout == "alive\n"
        with default_signals():
            assert end_itself().returncode == -ending
        assert signal.getsignal(ending) == signal.SIG_IGN
    finally:
        signal.signal(ending, before)


def test_a_process_that_does_not_end_is_ended():
    code = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); print(1, flush=True); time.sleep(600)"
    with started([sys.executable, "-S", "-c", code]) as process:
        assert process.stdout is not None and process.stdout.readline() == "1\n"
        process.terminate()
    assert process.returncode == -signal.SIGKILL
