"""Makes the pictures of "A photograph and a network" in docs/: python -m tests.truth.make_photograph ROOM [FOLDER].

ROOM is the folder of ICL-NUIM's living room. The photograph is its first picture, and the network a stand-in that knows
the room: it gives inverse depth through a line, at the size of a network's output, with edges as soft as a network's.
Two pictures more are turned: of that depth, enlarged to the size of the photograph, as it is and as `ps.load_frame`
takes it.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

import pointshade_gl as ps

LIGHT = ps.Light(position=(1.2, -0.9, 0.3), radius=0.05, shadow=True)
SIZE = (518, 392)
SOFT = 0.8  # pixels: standard deviation of the edges


def blurred(picture: np.ndarray) -> np.ndarray:
    weights = np.exp(-(np.arange(-4, 5) ** 2) / (2 * SOFT**2))
    wide = np.pad(picture, 4, mode="edge")
    rows = np.lib.stride_tricks.sliding_window_view(wide, 9, axis=0) @ (weights / weights.sum())
    return np.lib.stride_tricks.sliding_window_view(rows, 9, axis=1) @ (weights / weights.sum())


def main(room: Path, folder: Path) -> None:
    photo = ps.open_source(room)[0]
    depth = ps.render_depth(photo)

    def network(_: np.ndarray) -> dict[str, np.ndarray]:
        z = np.where(depth > 0, depth, 4 * depth.max())
        small = Image.fromarray((1 / z).astype(np.float32)).resize(SIZE, Image.Resampling.BICUBIC)
        return {"inverse_depth": 7 * blurred(np.asarray(small)) + 0.4}

    frame = ps.load_frame(color=photo.color, depth=network)
    ps.save_image(folder / "photograph.jpg", photo.color)
    ps.save_image(folder / "photograph_lit.jpg", ps.render(frame, LIGHT, exposure="auto", samples=16))
    inverse = Image.fromarray(network(photo.color)["inverse_depth"].astype(np.float32)).resize(photo.color.shape[1::-1])
    taken = ps.load_frame(color=photo.color, depth=np.asarray(inverse), depth_kind="inverse")
    given = ps.load_frame(depth=np.asarray(inverse), depth_kind="inverse")  # without colours it keeps its size
    for name, one in (("soft_given", ps.Frame(photo.color, given.depth, given.camera)), ("soft_taken", taken)):
        turned = ps.render(one, yaw=8, shading="none", samples=16, background="white")
        ps.save_image(folder / f"{name}.jpg", turned)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2] if len(sys.argv) > 2 else "assets/readme"))
