"""marimo notebook.

Sliders move the light, and the picture follows; in the page below it the light is under the mouse.

Install::

    pip install pointshade-gl marimo

`marimo edit marimo_notebook.py` opens it; `marimo run marimo_notebook.py` shows it without its code.
"""

import marimo

app = marimo.App(app_title="pointshade")


@app.cell
def _():
    import marimo as mo
    import numpy as np

    import pointshade_gl as ps

    return mo, np, ps


@app.cell
def _(mo):
    path = mo.ui.text("vase", label="frame: a folder, a depth file, or vase", full_width=True)
    path
    return (path,)


@app.cell
def _(np, path, ps):
    frame = ps.load_frame(path.value).at(np.eye(4))  # the world begins at its camera
    return (frame,)


@app.cell
def _(mo):
    right = mo.ui.slider(-1.5, 1.5, 0.05, value=-0.5, label="right")
    up = mo.ui.slider(-1.5, 1.5, 0.05, value=0.7, label="up")
    nearer = mo.ui.slider(-1, 1.5, 0.05, value=0.8, label="towards you")
    mo.hstack([right, up, nearer])
    return nearer, right, up


@app.cell
def _(frame, nearer, np, ps, right, up):
    # axes are x right, y down, z forward; the light is placed from the middle of the frame
    position = frame.pivot + frame.pivot[2] * np.array([right.value, -up.value, -nearer.value])
    ps.render(frame, light=ps.Light(position=position))
    return


@app.cell
def _(frame, ps):
    # the same in the browser alone: the light follows the mouse, a drag turns the object
    ps.show(frame)
    return


if __name__ == "__main__":
    app.run()
