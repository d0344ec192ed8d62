"""A Ray of two processors and two GPUs that are only counted, without dashboard and with little memory."""

from contextlib import contextmanager

import pytest

from pointshade_gl.batch.on_ray import settings_of_local


@contextmanager
def small_ray():
    """The module ray, connected. Without Ray the test is skipped."""
    ray = pytest.importorskip("ray")
    sizes = {"num_cpus": 2, "num_gpus": 2, "object_store_memory": 100_000_000}
    with settings_of_local():
        ray.init("local", **sizes, include_dashboard=False, log_to_driver=False, logging_level="CRITICAL")
    try:
        yield ray
    finally:
        ray.shutdown()
