"""Makes the pictures of the README's "From a photograph": python -m tests.truth.make_photograph [FOLDER].

The photograph is a rendering of the demo scene, and the network a stand-in that knows the scene: it gives inverse depth
through a line, at the size of a network's output, with edges as soft as a network's.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

import pointshade_gl as ps

LIGHTS = (ps.Light(position=(1.2, -0.9, 0.3), shadow=True),)
SIZE = (1280, 960)
SIDE = 518  # pixels of the network's shorter side


def main(folder: Path) -> None:
    scene = ps.load_scene("demo")
    camera = scene.camera.resized(*SIZE)
    photo = ps.render(scene, environment="studio", samples=16, camera=camera)
    depth = ps.render_depth(scene, camera=camera)
    shown = Image.new("RGB", photo.shape[1::-1], (226, 226, 226))
    shown.paste(Image.fromarray(photo), mask=Image.fromarray(photo[..., 3]))

    def network(rgb: np.ndarray) -> dict[str, np.ndarray]:
        z = np.where(depth > 0, depth, 4 * depth.max())
        size = round(SIDE * rgb.shape[1] / rgb.shape[0]), SIDE
        inverse = Image.fromarray((1 / z).astype(np.float32)).resize(size, Image.Resampling.BICUBIC)
        return {"inverse_depth": 7 * np.asarray(inverse) + 0.4}

    frame = ps.load_frame(color=np.asarray(shown), depth=network)
    lit = ps.render(frame, LIGHTS, samples=16)
    for name, picture in (("photograph", shown), ("photograph_lit", Image.fromarray(lit).convert("RGB"))):
        picture.resize((640, 480), Image.Resampling.LANCZOS).save(folder / f"{name}.jpg", quality=90)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "assets/readme"))
