"""Many requests, a pool of Renderers.

A server gives each request to `RendererPool`: any number of threads or coroutines ask, two Renderers draw.
Here twelve requests at once move the lamp around a frame: the vase, or your own, whose folder is the argument.
"""

import asyncio
import sys

import numpy as np

import pointshade_gl as ps

FRAME = ps.load_frame(*sys.argv[1:2] or ["vase"])
CAMERA = FRAME.camera.fitted(160, 120)


async def answer(pool, degrees):
    """What a handler of requests does."""
    angle = np.radians(degrees)
    aside = np.array([np.sin(angle), -0.3, -np.cos(angle)])
    lamp = ps.Light(position=FRAME.pivot + 0.7 * FRAME.pivot[2] * aside, shadow=True)
    return await pool.render_async(FRAME, lamp, missing="complete", camera=CAMERA, background="black", samples=4)


async def main():
    with ps.RendererPool(2) as pool:
        return await asyncio.gather(*(answer(pool, degrees) for degrees in range(-110, 120, 20)))


pictures = asyncio.run(main())
ps.save_image("render_pool.png", np.vstack([np.hstack(pictures[:6]), np.hstack(pictures[6:])]))
