"""Server with a view for each visitor.

Each browser has its own camera and its own light: all is drawn here, by one thread and one Renderer a visitor, and goes
to the browser as JPEG. The page and its scripts are rendercanvas'.

Install::

    pip install 'pointshade-gl[canvas]' fastapi uvicorn websockets simplejpeg

`python canvas_server.py [PORT [FOLDER]]` serves this machine, on port 8000 if none is given. Where all visitors may see
the same, `ps.canvas(frame, "http").run()` does without this file.
"""

import asyncio
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

from fastapi import FastAPI, HTTPException, Response, WebSocket, WebSocketDisconnect
from rendercanvas.core.encoders import encode_array
from rendercanvas.http import resources

import pointshade_gl as ps

MOST_VISITORS, MOST_SIDE, ON_THEIR_WAY = 8, 1600, 2  # at once; pixels; pictures that a browser has not yet shown
QUALITY = 80  # of JPEG

app = FastAPI()
app.state.source, app.state.visitors = "vase", 0


@app.get("/{name:path}")
def page(name: str) -> Response:
    if (name or "index.html") not in resources:
        raise HTTPException(404)
    kind, text = resources[name or "index.html"]
    return Response(text, media_type=kind)


@app.websocket("/")
async def visit(socket: WebSocket) -> None:
    """Draw for one visitor until the page is closed."""
    await socket.accept()
    if app.state.visitors >= MOST_VISITORS:
        await socket.close(1013, "too many visitors")
        return
    app.state.visitors += 1
    told: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
    listening = asyncio.create_task(listen(socket, told))
    try:
        with ThreadPoolExecutor(1) as thread:  # a Renderer belongs to the thread that made it
            made = thread.submit(ps.canvas, app.state.source, "offscreen")
            try:
                await answer(socket, told, thread, await asyncio.wrap_future(made))
            finally:
                thread.submit(lambda: made.result().canvas.close())
    except (WebSocketDisconnect, RuntimeError):  # the visitor has left while a picture was on its way
        pass
    finally:
        listening.cancel()
        app.state.visitors -= 1


async def answer(socket: WebSocket, told: asyncio.Queue, thread: ThreadPoolExecutor, view: Any) -> None:
    """Send pictures, as many as the browser shows, until it is told that the visitor has left."""
    in_thread = partial(asyncio.get_running_loop().run_in_executor, thread)
    sent = shown = 0
    seconds: float | None = 0.0
    while True:
        events = await some(told, seconds if sent - shown < ON_THEIR_WAY else None)
        if any(event["type"] == "close" for event in events):
            return
        shown = max([shown, *(event["index"] for event in events if event["type"] == "_framefeedback")])
        await in_thread(take, view, events)
        if sent - shown >= ON_THEIR_WAY:
            continue
        picture, seconds = await in_thread(draw, view)
        if picture is not None:
            sent += 1
            about = {"mimetype": picture[0], "index": sent, "timestamp": time.time(), "nbuffers": 1}
            await socket.send_json({"type": "framebufferdata", **about})
            await socket.send_bytes(picture[1])


async def listen(socket: WebSocket, told: asyncio.Queue) -> None:
    try:
        while True:
            told.put_nowait(await socket.receive_json())
    except (WebSocketDisconnect, ValueError):  # it has left, or sends what is no JSON
        told.put_nowait({"type": "close"})


async def some(told: asyncio.Queue, seconds: float | None) -> list[dict[str, Any]]:
    """All that was told, or nothing after so many seconds."""
    try:
        events = [await asyncio.wait_for(told.get(), seconds)]
    except asyncio.TimeoutError:
        return []
    while not told.empty():
        events.append(told.get_nowait())
    return events


def take(view: Any, events: list[dict[str, Any]]) -> None:
    """What the visitor did."""
    for event in events:
        if event["type"] == "resize":
            width, height = (min(max(int(event[side]), 1), MOST_SIDE) for side in ("pwidth", "pheight"))
            view.canvas.set_pixel_ratio(min(max(float(event["ratio"]), 1.0), 4.0))
            view.canvas.set_physical_size(width, height)
        else:
            view.send({"event_type": event["type"], "time_stamp": event["timestamp"], **event})


def draw(view: Any) -> tuple[tuple[str, bytes] | None, float | None]:
    """A picture, if it differs from the one before, and the seconds until there is another."""
    before = view.drawn
    picture = view.canvas.draw()
    encoded = encode_array(picture, QUALITY) if view.drawn != before else None
    return encoded, view.patience(time.perf_counter())


if __name__ == "__main__":
    import uvicorn

    app.state.source = (sys.argv[2:3] or ["vase"])[0]
    uvicorn.run(app, host="127.0.0.1", port=int(*sys.argv[1:2] or ["8000"]))
