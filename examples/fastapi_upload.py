"""FastAPI server.

POST a photograph and its depth, and get the picture under your light: two Renderers serve all requests.
A picture that is not there in time is given up, and where too many wait already the next is turned away.

Install::

    pip install pointshade-gl fastapi uvicorn python-multipart

`python fastapi_upload.py` serves this machine on port 8000, or on the port that is its argument::

    curl -F color=@color.png -F depth=@depth.png -F right=-0.5 -F up=0.7 -o lit.png http://127.0.0.1:8000/lit
"""

import io
import sys
import time
from concurrent import futures
from contextlib import asynccontextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import BoundedSemaphore
from typing import Annotated

import numpy as np
from fastapi import FastAPI, Form, HTTPException, Request, Response, UploadFile
from PIL import Image

import pointshade_gl as ps

MOST_BYTES, MOST_PIXELS = 30_000_000, 16_000_000  # of a request, of a picture
SECONDS, PLACES = 20, BoundedSemaphore(16)  # for a picture, waiting included; for requests at once: a pool has no limit
COLORS, DEPTHS = {".png", ".jpg", ".jpeg", ".webp"}, {".png", ".tif", ".tiff", ".npy", ".exr", ".pfm"}


@asynccontextmanager
async def lifespan(app: FastAPI):
    with ps.RendererPool(2) as app.state.pool:  # two pictures at once, each by a Renderer in a thread of its own
        yield


app = FastAPI(lifespan=lifespan)


@app.middleware("http")
async def small_enough(request: Request, go_on):
    """Turn large requests away before they are read."""
    length = request.headers.get("content-length", "")
    if request.method == "POST" and not (length.isdecimal() and int(length) <= MOST_BYTES):
        return Response(f"a request may have up to {MOST_BYTES} bytes, and says its length", 413)
    return await go_on(request)


@app.post("/lit", response_class=Response)
def lit(
    color: UploadFile,
    depth: UploadFile,
    right: Annotated[float, Form()] = -0.5,
    up: Annotated[float, Form()] = 0.7,
    nearer: Annotated[float, Form()] = 0.8,
    fov: Annotated[float | None, Form()] = None,
) -> Response:
    """As `def`, not `async def`: FastAPI runs it in a worker thread, which may wait for the pool."""
    if not PLACES.acquire(blocking=False):
        raise HTTPException(503, "too many pictures are being drawn: try again", {"Retry-After": "1"})
    deadline = time.monotonic() + SECONDS
    with TemporaryDirectory() as folder:
        try:
            files = {"color": kept(color, folder, "color", COLORS), "depth": kept(depth, folder, "depth", DEPTHS)}
            frame = ps.load_frame(**files, fov=fov, max_pixels=MOST_PIXELS)
            position = frame.pivot + frame.pivot[2] * np.array([right, -up, -nearer])  # x right, y down, z forward
            picture = drawn_in_time(app.state.pool, frame, ps.Light(position=position), deadline)
        except (ValueError, TypeError, OSError) as error:  # one sentence, without our folder
            raise HTTPException(400, str(error).replace(f"{folder}/", "")) from error
        finally:
            PLACES.release()
    data = io.BytesIO()
    Image.fromarray(picture).save(data, "PNG", compress_level=1)
    return Response(data.getvalue(), media_type="image/png")


def drawn_in_time(pool: ps.RendererPool, frame: ps.Frame, light: ps.Light, deadline: float) -> np.ndarray:
    """Waiting less does not end the work: what still waits is taken back, what is drawn ends at its next step."""
    waiting = pool.submit(frame, light=light, progress=lambda done, every: time.monotonic() < deadline)
    try:
        return waiting.result(deadline - time.monotonic())
    except (futures.TimeoutError, ps.Cancelled) as error:
        waiting.cancel()
        raise HTTPException(503, f"the picture was not there in {SECONDS} seconds: try again") from error


def kept(upload: UploadFile, folder: str, name: str, suffixes: set[str]) -> Path:
    """The upload as a file whose name is ours: what a path in its own name would do is not asked."""
    suffix = Path(upload.filename or "").suffix.lower()
    if suffix not in suffixes:
        raise ValueError(f"{name} must be a file of {', '.join(sorted(suffixes))}, got {suffix or 'no suffix'}")
    path = Path(folder, name).with_suffix(suffix)
    path.write_bytes(upload.file.read())
    return path


if __name__ == "__main__":
    import uvicorn

    uvicorn.run(app, host="127.0.0.1", port=int(*sys.argv[1:2] or ["8000"]))
