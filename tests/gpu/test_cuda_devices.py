"""The EGL device of a GPU that Ray hands to a worker: drivers are played by the numbers that they give."""

import sys

import pytest

from pointshade_gl.gpu.context import context as cuda_devices
from pointshade_gl.gpu.context.context import egl_device, matching

NODE = [2, 3, 0, 1, None]  # EGL's order is not CUDA's, and software comes last


@pytest.mark.parametrize("gpu", range(4))
def test_each_gpu_has_its_own_device(gpu):
    assert NODE[matching(NODE, str(gpu), ["0", "1", "2", "3"])] == gpu
    assert NODE[matching(NODE, str(gpu), [])] == gpu


def test_a_driver_counts_within_the_visible_gpus():
    assert matching([None, None, 0, None, None], "3", ["3"]) == 2
    assert matching([None, 1, 0, None], "5", ["4", "5"]) == 1
    assert matching([None, None, 0, None], "GPU-8932f937", ["GPU-8932f937"]) == 2


def test_a_driver_that_counts_all_gpus_is_understood():
    assert matching(NODE, "3", ["3"]) == 1
    assert matching([0, 0, 0, 0], "3", ["3"]) == 3  # it says nothing: EGL's order must do
    assert matching([0, 0, 0, 0], "GPU-8932f937", ["GPU-8932f937"]) == 0


def test_without_numbers_the_order_counts_and_ends_at_the_first_device():
    assert matching([None, None, None], "1", ["1"]) == 1
    assert matching([None], "1", ["1"]) == 0  # software only
    assert matching([], "2", []) == 0


def test_the_variable_is_split_at_its_commas(monkeypatch):
    monkeypatch.setattr(cuda_devices, "_cuda_numbers", lambda: [None, 1, 0, None])
    assert egl_device(5, "4,5") == 1
    assert egl_device(1, "") == 1


@pytest.mark.gl
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="EGL lists devices on Linux")
def test_the_driver_at_hand_is_asked(renderer):
    assert len(cuda_devices._cuda_numbers()) >= 1
    assert egl_device(0, "") < len(cuda_devices._cuda_numbers())
