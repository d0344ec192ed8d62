"""Small folders laid out exactly as public RGB-D sets and programs lay out theirs, filled with a real room.

Each maker is `maker(folder, room) -> Expected` and names the set or the program it follows. None was written with the
reader in view that it checks.
"""

from . import (
    capture_apps,
    manipulation,
    multi_view,
    networks,
    objects,
    open3d,
    radiance_fields,
    relative,
    rendered,
    robots,
    scans,
    sensors,
    simulated,
    single,
    stereo,
    traps,
    tum,
)

MODULES = (
    tum,
    open3d,
    scans,
    capture_apps,
    radiance_fields,
    multi_view,
    robots,
    sensors,
    stereo,
    traps,
    objects,
    manipulation,
    rendered,
    simulated,
    networks,
    relative,
    single,
)
MAKERS = [maker for module in MODULES for maker in module.MAKERS]
