"""gradio application.

A web page whose sliders, or a click on the picture, move the light; and into which depth and colour are dropped.

Install::

    pip install pointshade-gl gradio

`python gradio_light.py [FOLDER]` prints its address, on this machine only.
"""

import sys

import gradio as gr
import numpy as np

import pointshade_gl as ps

# gradio calls the functions below in threads of its own, but OpenGL belongs to the thread that began it: the pool draws
# in two threads that stay, each with its Renderer, and may be asked from any.
pool = ps.RendererPool(2)


def opened(path=None, notes=gr.Info, **files):
    """A frame whose camera is the world's origin; a guess and an error become a message on the page."""
    try:
        return ps.load_frame(path, notes=notes, **files).at(np.eye(4))
    except (ValueError, TypeError, OSError) as error:
        raise gr.Error(str(error)) from error


def drawn(frame, right, up, nearer, intensity):
    aside = np.array([right, -up, -nearer])  # our axes: x right, y down, z forward
    light = ps.Light(position=frame.pivot + frame.pivot[2] * aside, intensity=intensity)
    return pool.render(frame, light=light)


def clicked(frame, event: gr.SelectData):
    """Right and up of a light in front of the pixel that was clicked."""
    ray = np.array(frame.picture_camera.ray_at(*event.index))
    right, down = ray - frame.pivot[:2] / frame.pivot[2]
    return right, -down


def uploaded(color, depth):
    return opened(color=color, depth=depth)


with gr.Blocks(title="pointshade", fill_width=True, analytics_enabled=False) as page:
    frame = gr.State(opened(*sys.argv[1:2] or ["vase"], notes=print))
    with gr.Row():
        picture = gr.Image(format="png", image_mode="RGBA", label="Click to place the light", elem_id="lit", scale=3)
        with gr.Column():
            right = gr.Slider(-1.5, 1.5, -0.5, step=0.01, label="right")
            up = gr.Slider(-1.5, 1.5, 0.7, step=0.01, label="up")
            nearer = gr.Slider(-1, 1.5, 0.8, step=0.01, label="towards you")
            intensity = gr.Slider(0, 4, 1, step=0.01, label="intensity")
            color = gr.Image(type="filepath", label="your photograph", height=150)
            depth = gr.File(file_types=[".png", ".tif", ".npy", ".exr", ".pfm"], label="and its depth", height=120)
            button = gr.Button("Relight it")
    inputs = [frame, right, up, nearer, intensity]
    moved = [page.load, right.change, up.change, nearer.change, intensity.change, frame.change]
    gr.on(moved, drawn, inputs, picture, show_progress="hidden", trigger_mode="always_last")
    picture.select(clicked, frame, [right, up], show_progress="hidden")
    button.click(uploaded, [color, depth], frame)

if __name__ == "__main__":
    page.launch(server_name="127.0.0.1")
