"""Many requests, a pool of Renderers.

A server gives each request to `RendererPool`: any number of threads or coroutines ask, two Renderers draw.
Here twelve requests at once move the lamp around the vase.
"""

import asyncio

import numpy as np

import pointshade_gl as ps

FRAME = ps.load_frame("vase")
CAMERA = ps.Camera.from_fov(44, 106, 124)


async def answer(pool, degrees):
    """What a handler of requests does."""
    angle = np.radians(degrees)
    aside = np.array([np.sin(angle), -0.3, -np.cos(angle)])
    lamp = ps.Light(position=FRAME.pivot + 0.9 * aside)
    return await pool.render_async(FRAME, lamp, camera=CAMERA, background="black", samples=4)


async def main():
    with ps.RendererPool(2) as pool:
        return await asyncio.gather(*(answer(pool, degrees) for degrees in range(-110, 120, 20)))


pictures = asyncio.run(main())
ps.save_image("render_pool.png", np.vstack([np.hstack(pictures[:6]), np.hstack(pictures[6:])]))
