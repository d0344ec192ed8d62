"""Examples in other programs run as a user types them; their results are compared by number, or with stored pictures.

Those that need nothing else, and the gallery's page: test_gallery.py.
"""

import asyncio
import importlib.util
import io
import json
import re
import shutil
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps

from ..support.compare import compare_images
from ..support.example_scripts import EXAMPLES, free_port, run_example, served
from ..support.gallery import arguments, save_stored
from . import comfy_stub
from .conftest import missing

PLACE = np.array([-0.5, -0.7, -0.8])  # where most examples put their light, from the middle, in units of the distance


def need(*modules: str) -> None:
    """Skip the test without these modules, or fail it where all clients must be there."""
    for name in modules:
        if importlib.util.find_spec(name) is None:
            missing(f"no {name}")


@pytest.fixture(scope="module")
def vase():
    return ps.load_frame("vase")


@pytest.fixture
def lamp(vase):
    return ps.Light(position=vase.pivot + vase.pivot[2] * PLACE)


def opened(path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image)


@pytest.mark.system
@pytest.mark.gl
class TestTrimesh:
    def test_points_come_back_and_both_stand_under_one_light(self, renderer, tmp_path, stored):
        trimesh = pytest.importorskip("trimesh")
        pytest.importorskip("scipy")
        given = arguments("trimesh_roundtrip")
        frame, printed = ps.load_frame(*given or ["vase"]), run_example(tmp_path, "trimesh_roundtrip", *given)
        near = 1e-6 * max(1, frame.pivot[2])
        assert float(re.search(r"at most (\S+) m apart", printed)[1]) < near
        (cloud,) = trimesh.load_scene(tmp_path / "trimesh_roundtrip.glb").geometry.values()
        points = frame.camera.unproject(frame.depth)[frame.depth > 0]
        np.testing.assert_allclose(cloud.vertices, points * (1, -1, -1), atol=near)  # y up, towards the viewer
        stored("trimesh_roundtrip", opened(tmp_path / "trimesh_roundtrip.png"))


@pytest.mark.clients
@pytest.mark.gl
class TestOpen3D:
    @pytest.fixture
    def vase(self, vase):
        """As Open3D has it: colours, depth and a camera. What is built in turns about another place."""
        return ps.Frame(vase.color, vase.depth, vase.camera)

    def test_points_normals_and_light_are_the_same_in_both(self, renderer, tmp_path, vase, lamp):
        need("open3d")
        printed = run_example(tmp_path, "open3d_roundtrip")
        assert float(re.search(r"at most (\S+) m apart", printed)[1]) < 1e-9
        import open3d as o3d

        cloud = o3d.io.read_point_cloud(str(tmp_path / "open3d_roundtrip.ply"))
        lit = ps.render_points(vase, lamp)
        np.testing.assert_allclose(np.asarray(cloud.points), lit.positions, atol=1e-9)
        np.testing.assert_allclose(np.asarray(cloud.normals), lit.normals, atol=1e-6)
        np.testing.assert_allclose(np.asarray(cloud.colors) * 255, lit.colors, atol=1)

    def test_what_open3d_draws_is_what_render_draws(self, renderer, tmp_path, vase, lamp):
        need("open3d")
        run_example(tmp_path, "open3d_roundtrip")
        theirs = opened(tmp_path / "open3d_roundtrip.png")
        ours = renderer.render(vase, lamp, camera=vase.camera.resized(480, 360))
        inside = ours[..., 3] == 255
        assert np.median(np.abs(theirs[..., :3].astype(int) - ours[..., :3])[inside]) < 10
        assert (theirs[~inside & (ours[..., 3] == 0)] == 255).mean() > 0.95

    @pytest.mark.system
    def test_its_mesh_of_all_views_is_lit_as_the_views_are(self, renderer, tmp_path, stored):
        need("open3d")
        printed = run_example(tmp_path, "open3d_mesh")
        triangles, apart = re.search(r"(\d+) triangles.* are (\d+) of 255", printed).groups()
        assert int(triangles) > 100_000 and int(apart) <= 8
        stored("open3d_mesh", opened(tmp_path / "open3d_mesh.png"))


def logged(path) -> dict[str, list]:
    """What an .rrd holds: by entity and component, the rows in their order."""
    from rerun.chunk import RrdReader

    found: dict[str, list] = {}
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            found.setdefault(f"{chunk.entity_path} {name}", []).extend(batch.column(name))
    return found


@pytest.fixture(scope="module")
def rows(renderer, tmp_path_factory):
    need("rerun", "pyarrow")
    folder = tmp_path_factory.mktemp("rerun")
    run_example(folder, "rerun_log")
    return logged(folder / "rerun_log.rrd")


@pytest.mark.clients
@pytest.mark.gl
class TestRerun:
    @staticmethod
    def one(rows, name):
        (row,) = rows[name]
        return np.array(row.as_py())

    def test_camera_and_axes_are_those_of_the_frame(self, rows, vase):
        c = vase.camera
        matrix = self.one(rows, "/world/camera Pinhole:image_from_camera").reshape(3, 3).T  # by columns
        np.testing.assert_allclose(matrix, [[c.fx, 0, c.cx + 0.5], [0, c.fy, c.cy + 0.5], [0, 0, 1]])
        for name in ("/world ViewCoordinates:xyz", "/world/camera Pinhole:camera_xyz"):
            assert self.one(rows, name).ravel().tolist() == [3, 2, 5]  # right, down, forward
        np.testing.assert_allclose(
            self.one(rows, "/world/camera Transform3D:mat3x3").reshape(3, 3).T, vase.pose[:3, :3]
        )

    def test_points_project_onto_the_pixels_of_the_depth(self, rows, vase):
        points = self.one(rows, "/world/points Points3D:positions").reshape(-1, 3)
        matrix = self.one(rows, "/world/camera Pinhole:image_from_camera").reshape(3, 3).T
        seen = points @ matrix.T
        v, u = np.nonzero(vase.depth)
        np.testing.assert_allclose(seen[:, :2] / seen[:, 2:], np.stack([u, v], axis=1) + 0.5, atol=1e-3)
        depth = np.array(rows["/world/camera/depth DepthImage:buffer"][0].as_py(), np.uint8).view(np.float32)
        np.testing.assert_array_equal(depth.reshape(480, 640), vase.depth)

    def test_normals_face_the_camera_and_the_light_goes_round(self, rows, vase):
        origins = self.one(rows, "/world/normals Arrows3D:origins").reshape(-1, 3)
        vectors = self.one(rows, "/world/normals Arrows3D:vectors").reshape(-1, 3)
        assert ((origins * vectors).sum(axis=1) < 0).mean() > 0.99
        places = [row.as_py()[0] for row in rows["/world/light Points3D:positions"]]
        lights = [row.as_py() for row in rows["/world/light light"]]
        by_step = dict(zip(lights, places, strict=True))
        colors = dict(
            zip(
                (row.as_py() for row in rows["/world/points light"]), rows["/world/points Points3D:colors"], strict=True
            )
        )
        assert sorted(by_step) == sorted(colors) == list(range(12))
        for step in (0, 5):
            logged_colors = np.array(colors[step].as_py(), ">u4").view(np.uint8).reshape(-1, 4)[:, :3]
            lit = ps.render_points(vase, ps.Light(position=by_step[step])).colors
            assert np.abs(logged_colors.astype(int) - lit).max() <= 1


def loaded_as_comfyui_does(path: Path):
    """The module of a custom node: a file, or a folder with __init__.py, under a name made of its path."""
    entry = path / "__init__.py" if path.is_dir() else path
    spec = importlib.util.spec_from_file_location(str(path).replace(".", "_x_"), entry)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def comfyui(renderer, tmp_path_factory):
    """The pack as ComfyUI loads it out of custom_nodes; beside it a folder temp."""
    need("torch")
    folder = tmp_path_factory.mktemp("ComfyUI")
    shutil.copytree(EXAMPLES / "comfyui", folder / "custom_nodes/pointshade")
    with pytest.MonkeyPatch.context() as patch:
        for name, module in comfy_stub.modules(folder / "temp").items():
            patch.setitem(sys.modules, name, module)
        yield loaded_as_comfyui_does(folder / "custom_nodes/pointshade"), folder


@pytest.fixture(scope="module")
def node(comfyui):
    (node,) = asyncio.run(asyncio.run(comfyui[0].comfy_entrypoint()).get_node_list())
    return node


@pytest.mark.clients
@pytest.mark.gl
class TestComfyUI:
    @pytest.fixture
    def tensors(self, vase):
        import torch

        color = torch.from_numpy(vase.color[None, ..., :3] / np.float32(255))
        near, far = vase.depth_range
        inverse = np.where(vase.depth > 0, (1 / np.maximum(vase.depth, near) - 1 / far) / (1 / near - 1 / far), 0)
        return color, torch.from_numpy(inverse[None, ..., None].repeat(3, axis=-1).astype(np.float32))

    @pytest.fixture
    def moge(self, vase):
        """What ComfyUI's MoGe says of the vase: the matrix counts in sides of the picture, unknown depth is inf."""
        import torch

        c, (height, width) = vase.camera, vase.depth.shape
        matrix = torch.tensor([[c.fx / width, 0, 0.5], [0, c.fy / height, 0.5], [0, 0, 1]])
        depth = torch.tensor(np.where(vase.depth > 0, vase.depth, np.inf))[None].float()
        return {"depth": depth, "intrinsics": matrix[None].float(), "mask": torch.isfinite(depth)}

    @staticmethod
    def call(node, image, depth=None, *, page=False, **changed):
        """As ComfyUI calls it: by name, with what the widgets show at first, in a thread that is not the main one."""
        given = {one.id: one.default for one in node.define_schema().inputs if hasattr(one, "default")}
        given |= {"image": image, "page": page, **changed} | ({} if depth is None else {"depth": depth})
        assert set(given) <= {one.id for one in node.define_schema().inputs}
        with ThreadPoolExecutor(1) as thread:
            return thread.submit(node.execute, **given).result()

    def lit(self, node, *inputs, **changed):
        return self.call(node, *inputs, **changed).args

    def test_saved_workflows_find_the_node_its_widgets_and_its_outputs(self, node):
        schema = node.define_schema()
        assert schema.node_id == "PointshadeRelight"
        assert [one.io_type for one in schema.outputs] == ["IMAGE", "IMAGE", "MASK", "MASK"]
        assert [one.display_name for one in schema.outputs] == ["lit", "normals", "surface", "shadow"]
        inputs = {one.id: one for one in schema.inputs}
        assert inputs["geometry"].io_type == "MOGE_GEOMETRY,DA3_GEOMETRY"
        assert [name for name, one in inputs.items() if one.optional] == ["depth", "geometry"]
        names = "depth_kind far fov light right up towards_viewer red green blue intensity ambient diffuse specular"
        kept = [
            *names.split(),
            "shininess",
            "shadow",
            "unlight",
        ]  # their values are saved by order: new ones go to the end
        assert [name for name, one in inputs.items() if hasattr(one, "default")][: len(kept)] == kept
        for name, one in inputs.items():
            if one.io_type == "FLOAT":
                assert one.min <= one.default <= one.max, name

    def test_the_pack_has_what_the_registry_and_the_manager_read(self):
        folder = EXAMPLES / "comfyui"
        about = (folder / "pyproject.toml").read_text()
        (needs,) = (folder / "requirements.txt").read_text().split()
        assert f'dependencies = ["{needs}"]' in about
        assert (
            re.search(r'^version = "\d+\.\d+\.\d+"$', about, re.MULTILINE) and "[tool.comfy]\nPublisherId = " in about
        )

    def test_depth_of_a_network_is_lit_as_render_lights_its_metres(self, node, tensors, vase):
        image, depth = tensors
        lit, normals, surface, shadow = self.lit(node, image, depth, far=3.0, fov=50.0)
        assert lit.shape == normals.shape == (1, 480, 640, 3) and surface.shape == shadow.shape == (1, 480, 640)
        assert lit.dtype == normals.dtype == surface.dtype == shadow.dtype == image.dtype
        assert lit.min() >= 0 and lit.max() <= 1
        metres = 1 / (1 / 3 + depth[0, ..., 0].numpy() * (1 - 1 / 3))
        frame = ps.Frame(vase.color[..., :3], metres, ps.Camera.from_fov(50, 640, 480))
        light = ps.Light(position=frame.pivot + frame.pivot[2] * np.array([-0.6, -0.7, -0.8]))
        assert not compare_images((lit[0].numpy() * 255).round().astype(int), ps.render(frame, light)[..., :3])
        assert surface.min() == 1  # a network has depth everywhere

    def test_metres_leave_what_has_no_depth_out_of_the_mask(self, node, tensors, vase):
        import torch

        metres = torch.tensor(vase.depth[None, ..., None])
        _, normals, surface, shadow = self.lit(node, tensors[0], metres, depth_kind="metres")
        known = vase.depth > 0
        assert (surface[0].numpy()[known] == 1).mean() > 0.99 and (surface[0].numpy()[~known] == 0).mean() > 0.99
        assert (shadow <= surface).all()
        vectors = normals[0].numpy()[known] * 2 - 1
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1).mean(), 1, atol=0.02)
        assert vectors[:, 2].mean() > 0.5  # blue is towards the viewer

    def expected(self, vase, camera):
        frame = ps.Frame(vase.color[..., :3], vase.depth, camera)
        return ps.render(frame, ps.Light(position=frame.pivot + frame.pivot[2] * np.array([-0.6, -0.7, -0.8])))[..., :3]

    @pytest.mark.parametrize("network", ["moge", "depth anything 3"])
    def test_geometry_brings_its_own_camera_and_depth(self, node, tensors, vase, moge, network):
        """Depth Anything 3 counts in pixels of what its network saw, here 504 x 378."""
        import torch

        if network != "moge":
            sides = torch.diag(torch.tensor([504.0, 378.0, 1.0]))
            depth = moge["depth"].nan_to_num(posinf=5.0)
            moge = {"depth": depth, "sky": (depth == 5.0).float(), "mode": "multiview"} | {
                "intrinsics": (sides @ moge["intrinsics"])[None]
            }
        lit = self.lit(node, tensors[0], tensors[1], geometry=moge, fov=120.0, far=50.0)[0]
        c = vase.camera
        middle = ps.Camera(c.fx, c.fy, 319.5, 239.5, 640, 480)
        assert not compare_images((lit[0].numpy() * 255).round().astype(int), self.expected(vase, middle))

    def test_geometry_without_a_camera_takes_the_widget_and_its_depth_as_it_is(self, node, tensors, vase, moge):
        import torch

        depth = moge["depth"].nan_to_num(posinf=0.0)
        bare = {"depth": depth, "mode": "mono"}
        unknown = bare | {"mode": "multiview", "intrinsics": torch.eye(3)[None, None]}
        for geometry in (bare, unknown):
            lit = self.lit(node, tensors[0], geometry=geometry, fov=40.0, far=50.0)[0]
            seen = self.expected(vase, ps.Camera.from_fov(40, 640, 480))
            assert not compare_images((lit[0].numpy() * 255).round().astype(int), seen)

    def test_what_gives_no_depth_is_said(self, node, tensors, moge):
        with pytest.raises(ValueError, match="connect depth, or geometry"):
            self.call(node, tensors[0])
        with pytest.raises(ValueError, match="a panorama has none"):
            self.call(node, tensors[0], geometry={"depth": moge["depth"], "mask": moge["mask"]})

    @pytest.mark.parametrize(("side", "brighter"), [(-3.0, np.s_[:, :320]), (3.0, np.s_[:, 320:])])
    @pytest.mark.parametrize("light", ["lamp", "sun"])
    def test_the_light_is_where_the_widgets_say(self, node, light, side, brighter):
        import torch

        v, u = np.mgrid[-1:1:240j, -1:1:320j]
        ball = torch.from_numpy(np.sqrt(np.maximum(1 - u * u - v * v, 0)).astype(np.float32))[None, ..., None]
        grey = torch.full((1, 480, 640, 3), 0.5)
        lit, _, _, shadow = self.lit(node, grey, ball, light=light, right=side, up=0.0, towards_viewer=0.5, far=1.5)
        other = np.s_[:, 320:] if brighter == np.s_[:, :320] else np.s_[:, :320]
        assert lit.shape == (1, 480, 640, 3)  # the larger of the two sizes
        assert lit[0].numpy()[brighter].mean() > 1.5 * lit[0].numpy()[other].mean()
        assert shadow[0].numpy()[other].mean() > shadow[0].numpy()[brighter].mean() + 0.1

    def test_the_shadow_is_where_something_is_before_the_light(self, node):
        """A plate before a wall, under a sun from the left: its shadow is to its right."""
        import torch

        metres = torch.full((1, 120, 160, 1), 2.0)
        metres[:, 40:80, 60:80] = 1.8
        sun = {"depth_kind": "metres", "light": "sun", "right": -1.0, "up": 0.0, "towards_viewer": 1.0}
        shadow = self.lit(node, torch.ones(1, 120, 160, 3), metres, **sun)[3][0].numpy()
        assert shadow[50:70, 82:88].min() > 0.9
        assert shadow[50:70, 20:55].max() < 0.1 and shadow[50:70, 62:78].max() < 0.1 and shadow[:30].max() < 0.1

    def test_batches_are_lit_one_by_one_and_one_depth_serves_all(self, node, tensors):
        import torch

        image, depth = (one[:, ::4, ::4] for one in tensors)
        images, depths = torch.cat([image, image.flip(2)]), torch.cat([depth, depth.flip(2)])
        both = self.lit(node, images, depths)
        for k in range(2):
            alone = self.lit(node, images[k : k + 1], depths[k : k + 1])
            for of_both, of_one in zip(both, alone, strict=True):
                assert torch.equal(of_both[k], of_one[0])
        shared = self.lit(node, images, depth)
        assert torch.equal(shared[0][0], both[0][0]) and not torch.equal(shared[0][1], both[0][1])

    def test_as_many_depths_as_images_or_one(self, node, tensors):
        image, depth = tensors
        with pytest.raises(ValueError, match="3 images need 3 depths or 1, got 2"):
            self.call(node, image.expand(3, -1, -1, -1), depth.expand(2, -1, -1, -1))

    @pytest.mark.system
    @pytest.mark.browser
    def test_below_the_node_the_light_follows_the_mouse(self, comfyui, node, page, tensors, moge):
        """ComfyUI's window is a page here that gives its script what ComfyUI gives it, and serves what it serves."""
        shown = self.call(node, tensors[0], geometry=moge, page=True).ui
        assert [one["type"] for one in shown["images"]] == ["temp"]
        module, folder = comfyui
        script = folder / "custom_nodes/pointshade" / module.WEB_DIRECTORY / "page.js"
        files = {
            "/": ("text/html", "<body><script type=module src=/extensions/pointshade/page.js></script>"),
            "/extensions/pointshade/page.js": ("text/javascript", script.read_text()),
            "/scripts/api.js": ("text/javascript", "export const api = { fetchApi: (path) => fetch(path) };"),
            "/scripts/app.js": ("text/javascript", COMFYUI_WINDOW % json.dumps(shown)),
            "/view": (
                "application/octet-stream",
                (folder / "temp" / shown["pointshade_page"][0]["filename"]).read_text(),
            ),
        }

        def answer(route):
            kind, text = files[route.request.url.removeprefix("http://localhost").partition("?")[0]]
            route.fulfill(content_type=kind, body=text)

        opened_page = page("about:blank", 700, 700)
        opened_page.route("http://localhost/**", answer)
        opened_page.goto("http://localhost/")
        follows_the_mouse(opened_page, opened_page.locator("iframe"))

    def test_it_lights_the_vase(self, node, tensors, moge, stored):
        import torch

        lit, normals, surface, shadow = self.lit(node, tensors[0], geometry=moge, shadow=True)
        masks = [mask[..., None].expand(-1, -1, -1, 3) for mask in (surface, shadow)]
        wide = torch.cat([one[:, :, 112:528] for one in (tensors[0], lit, normals, *masks)], dim=2)
        half = torch.nn.functional.avg_pool2d(wide.permute(0, 3, 1, 2), 2)[0].permute(1, 2, 0)
        stored("comfyui", (half.numpy() * 255 + 0.5).astype(np.uint8))


COMFYUI_WINDOW = """
const node = { comfyClass: "PointshadeRelight", addDOMWidget(name, type, element) {
  element.style.height = "400px";
  document.body.append(element);
  return {};
} };
export const app = { registerExtension(extension) {
  extension.nodeCreated(node);
  node.onExecuted(%s);
} };
"""


def png(picture: np.ndarray) -> bytes:
    data = io.BytesIO()
    Image.fromarray(picture).save(data, "PNG")
    return data.getvalue()


@pytest.fixture(scope="module")
def app(renderer):
    need("fastapi", "httpx", "multipart")
    from fastapi.testclient import TestClient

    module = loaded_as_comfyui_does(EXAMPLES / "fastapi_upload.py")
    with TestClient(module.app) as client:
        yield client


@pytest.mark.clients
@pytest.mark.gl
class TestFastAPI:
    @staticmethod
    def files(frame):
        """Colours, and depth in millimetres."""
        depth = png((frame.depth * 1000).round().astype(np.uint16))
        return {"color": ("photo.png", png(frame.color)), "depth": ("depth.png", depth)}

    @pytest.fixture
    def upload(self, vase):
        return self.files(vase)

    @staticmethod
    def picture(reply) -> np.ndarray:
        assert reply.status_code == 200, reply.text
        assert reply.headers["content-type"] == "image/png"
        return opened(io.BytesIO(reply.content))

    @staticmethod
    def ours(vase, place, fov=40.5):
        camera = ps.Camera.from_fov(fov, 640, 480)
        frame = ps.load_frame(color=vase.color, depth=(vase.depth * 1000).round().astype(np.uint16), intrinsics=camera)
        return ps.render(frame, ps.Light(position=frame.pivot + frame.pivot[2] * np.array(place)))

    def test_the_picture_is_that_of_render(self, app, upload, vase):
        reply = app.post("/lit", files=upload, data={"fov": 40.5})
        assert not compare_images(self.picture(reply), self.ours(vase, PLACE))

    def test_requests_at_once_get_each_their_own_light(self, app, upload, vase):
        places = np.linspace(-1, 1, 8)

        def ask(right):
            return self.picture(app.post("/lit", files=upload, data={"fov": 40.5, "right": right}))

        with ThreadPoolExecutor(8) as threads:
            for right, picture in zip(places, threads.map(ask, places), strict=True):
                assert not compare_images(picture, self.ours(vase, (right, -0.7, -0.8)))
        assert sum(thread.name.startswith("pointshade") for thread in threading.enumerate()) == 2

    @pytest.mark.parametrize(
        ("changed", "words"),
        [
            ({"depth": ("depth.png", b"no picture")}, "depth.png"),
            ({"depth": ("depth.png", b"")}, "depth.png"),
            ({"depth": ("model.onnx", b"\x08\x07")}, "depth must be a file of .exr, .npy"),
            ({"depth": ("depth.zip", b"PK\x03\x04")}, "got .zip"),
            ({"color": ("photo", b"x")}, "got no suffix"),
            ({"color": ("photo.png", b"\x89PNG\r\n\x1a\n" + b"\0" * 50)}, "color.png"),
            (
                {"depth": ("depth.npy", b"\x93NUMPY\x01\0v\0{'descr': '|O', 'fortran_order': False, 'shape': (1,)}")},
                "depth.npy",
            ),
        ],
        ids=["no picture", "empty", "network", "archive", "no suffix", "broken picture", "pickle"],
    )
    def test_what_cannot_be_read_is_refused_in_a_sentence_that_names_no_folder(self, app, upload, changed, words):
        reply = app.post("/lit", files=upload | changed)
        assert reply.status_code == 400 and words in reply.json()["detail"]
        assert "/tmp" not in reply.text and "Traceback" not in reply.text

    def test_a_name_that_leads_elsewhere_is_only_a_name(self, app, upload):
        name = "../../../../etc/evil.png"
        self.picture(app.post("/lit", files=upload | {"color": (name, upload["color"][1])}, data={"fov": 40.5}))

    @pytest.mark.parametrize("data", [{"fov": 400}, {"right": "nan"}, {"up": "inf"}])
    def test_numbers_that_mean_nothing_are_refused(self, app, upload, data):
        assert app.post("/lit", files=upload, data=data).status_code == 400

    def test_pictures_with_too_many_pixels_are_refused_before_they_are_unpacked(self, app, upload):
        large = png(np.zeros((5000, 5000), np.uint16))
        reply = app.post("/lit", files=upload | {"depth": ("depth.png", large)})
        assert reply.status_code == 400 and "16" in reply.json()["detail"]

    def test_requests_that_are_too_large_or_say_no_length_are_turned_away(self, app):
        assert app.post("/lit", content=b"x", headers={"content-length": "30000001"}).status_code == 413
        assert app.post("/lit", content=iter([b"x"])).status_code == 413

    def test_a_picture_that_is_late_is_given_up_and_too_many_are_turned_away(self, app, upload, monkeypatch):
        home = app.post.__self__.app.router.routes[-1].endpoint.__globals__
        monkeypatch.setitem(home, "SECONDS", 0)
        assert "not there in 0 seconds" in app.post("/lit", files=upload).json()["detail"]
        monkeypatch.setitem(home, "SECONDS", 20)
        monkeypatch.setitem(home, "PLACES", threading.BoundedSemaphore(1))
        with home["PLACES"]:
            reply = app.post("/lit", files=upload)
        assert reply.status_code == 503 and reply.headers["retry-after"] == "1"
        self.picture(app.post("/lit", files=upload))  # nothing is left behind

    @pytest.mark.system
    def test_it_serves_as_typed(self, renderer, tmp_path, stored):
        need("fastapi", "uvicorn", "httpx")
        import httpx

        frame = ps.load_frame(*arguments("fastapi_upload") or ["vase"])
        fov = float(np.degrees(2 * np.arctan(240 / frame.camera.fy)))
        with served(tmp_path, sys.executable, EXAMPLES / "fastapi_upload.py", "0") as address:
            reply = httpx.post(f"{address}/lit", files=self.files(frame), data={"fov": fov}, timeout=60)
        picture = self.picture(reply)
        assert not compare_images(picture, self.ours(frame, PLACE, fov))
        stored("fastapi_upload", np.asarray(Image.fromarray(picture).reduce(2)))


@pytest.fixture
def page(browser):
    """page(address, width, height): a page of a server on this machine, which asks for nothing from elsewhere."""
    contexts = []

    def open_it(address, width=1000, height=1000):
        context = browser.chromium.new_context(viewport={"width": width, "height": height})
        contexts.append(context)
        context.route(re.compile(r"^https?://(?!127\.0\.0\.1|localhost)"), lambda route: route.abort())
        opened_page = context.new_page()
        opened_page.goto(address)
        return opened_page

    yield open_it
    for context in contexts:
        context.close()


def screenshot(page, request, name: str, **options) -> None:
    """Rewrite the gallery's picture of an application, if asked."""
    if request.config.getoption("--update-golden"):
        picture = Image.fromarray(opened(io.BytesIO(page.screenshot(**options)))[..., :3])
        smaller = picture.resize((480, round(480 * picture.height / picture.width)), Image.Resampling.LANCZOS)
        save_stored(name, np.asarray(smaller))


def follows_the_mouse(page, cell) -> None:
    """Whether the light of a page in a notebook's cell goes where the mouse goes."""
    inside = cell.content_frame
    inside.locator("body.live").wait_for(timeout=60_000)
    cell.scroll_into_view_if_needed()
    box, marker = cell.bounding_box(), inside.locator("#marker")
    page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 0.3 * box["height"])
    before = marker.bounding_box()
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 0.5 * box["height"], steps=6)
    assert marker.bounding_box()["x"] > before["x"] + 0.1 * box["width"]


def is_live(page, image) -> None:
    """Whether the picture of a canvas in a notebook's cell is another where the mouse is elsewhere."""
    image.scroll_into_view_if_needed()
    box, pictures = image.bounding_box(), []
    for across in (0.4, 0.6):
        page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.3 * box["height"])
        page.mouse.move(box["x"] + across * box["width"], box["y"] + 0.3 * box["height"], steps=6)
        page.wait_for_timeout(14_000)  # the light is there, the picture is refined, the greeting is gone
        pictures.append(opened(io.BytesIO(image.screenshot())).astype(int))
    assert np.abs(pictures[1] - pictures[0]).mean() > 2


def shown_picture(image) -> np.ndarray:
    """The pixels of an <img>, whatever it comes from."""
    script = """async (image) => {
        const bytes = new Uint8Array(await (await fetch(image.currentSrc || image.src)).arrayBuffer());
        return Array.from(bytes);
    }"""
    return opened(io.BytesIO(bytes(image.evaluate(script))))


@pytest.mark.clients
@pytest.mark.system
@pytest.mark.gl
@pytest.mark.browser
class TestGradio:
    @pytest.fixture
    def opened_page(self, renderer, page, tmp_path):
        need("gradio")
        with served(
            tmp_path,
            sys.executable,
            EXAMPLES / "gradio_light.py",
            *arguments("gradio_light"),
            GRADIO_SERVER_PORT=str(free_port()),
        ) as address:
            opened_page = page(address, 1000, 700)
            opened_page.locator("#lit img").wait_for(timeout=60_000)
            yield opened_page

    @staticmethod
    def wait_for_picture(page, expected) -> None:
        for _ in range(100):
            if page.locator("#lit img").count():
                picture = shown_picture(page.locator("#lit img"))
                if not compare_images(picture, expected):
                    return
            page.wait_for_timeout(100)
        raise AssertionError(compare_images(picture, expected))

    @staticmethod
    def lit(frame, right, up, nearer=0.8):
        return ps.render(frame, ps.Light(position=frame.pivot + frame.pivot[2] * np.array([right, -up, -nearer])))

    def test_sliders_and_clicks_move_the_light(self, opened_page, request):
        frame = ps.load_frame(*arguments("gradio_light") or ["vase"]).at(np.eye(4))
        self.wait_for_picture(opened_page, self.lit(frame, -0.5, 0.7))
        screenshot(opened_page, request, "gradio_light")
        slider = opened_page.get_by_label("number input for right")
        slider.fill("0.8")
        slider.press("Enter")
        self.wait_for_picture(opened_page, self.lit(frame, 0.8, 0.7))
        box = opened_page.locator("#lit img").bounding_box()
        opened_page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        opened_page.wait_for_function(
            "() => Math.abs(document.querySelector('[aria-label^=\"number input for right\"]').value) < 0.05"
        )

    @staticmethod
    def upload(page, folder, name, depth) -> None:
        ps.save_image(folder / "photo.png", np.full((60, 80, 3), (200, 100, 50), np.uint8))
        np.save(folder / name, depth)
        files = page.locator("input[type=file]")
        files.nth(0).set_input_files(folder / "photo.png")
        files.last.set_input_files(folder / name)
        page.get_by_text(name).first.wait_for()
        page.get_by_text("Relight it").click()

    def test_a_photograph_and_its_depth_are_lit(self, opened_page, tmp_path):
        depth = 1 + 0.1 * np.sin(np.arange(80, dtype=np.float32) / 8)[None].repeat(60, axis=0)
        self.upload(opened_page, tmp_path, "waves.npy", depth)
        frame = ps.load_frame(color=tmp_path / "photo.png", depth=tmp_path / "waves.npy")
        self.wait_for_picture(opened_page, self.lit(frame, -0.5, 0.7))

    def test_what_is_no_depth_is_named_in_a_message(self, opened_page, tmp_path):
        self.upload(opened_page, tmp_path, "text.npy", np.array(["no depth"]))
        message = opened_page.locator(".toast-body.error").first
        message.wait_for()
        assert "text.npy" in message.inner_text()


def started(program: str) -> list[str]:
    """`python -m` of a program whose own command may not be on the path."""
    return [sys.executable, "-m", program]


@pytest.mark.clients
@pytest.mark.gl
class TestMarimo:
    def test_it_runs_as_a_script_and_its_picture_is_that_of_render(self, renderer, vase, lamp):
        need("marimo")
        module = loaded_as_comfyui_does(EXAMPLES / "marimo_notebook.py")
        outputs, values = module.app.run()
        (picture,) = [one for one in outputs if isinstance(one, np.ndarray)]
        assert not compare_images(picture, ps.render(vase, lamp)) and values["frame"].depth.shape == (480, 640)

    @pytest.mark.system
    @pytest.mark.browser
    def test_the_cell_is_drawn_and_its_light_follows_the_mouse(self, renderer, page, tmp_path, request, vase):
        need("marimo")
        command = [*started("marimo"), "run", EXAMPLES / "marimo_notebook.py", "--headless", "--host", "127.0.0.1"]
        with served(tmp_path, *command) as address:
            opened_page = page(address, 900, 1160)
            follows_the_mouse(opened_page, opened_page.locator("iframe"))
            screenshot(opened_page, request, "marimo_notebook")
            still = opened_page.locator("img").first
            before = shown_picture(still)
            opened_page.get_by_role("slider").first.press("ArrowRight")
            for _ in range(100):
                if (picture := shown_picture(still)).tobytes() != before.tobytes():
                    break
                opened_page.wait_for_timeout(100)
            light = ps.Light(position=vase.pivot + vase.pivot[2] * np.array([-0.45, -0.7, -0.8]))
            assert not compare_images(picture, ps.render(vase, light))


@pytest.mark.clients
@pytest.mark.gl
class TestJupyter:
    def test_its_cells_show_the_pictures_and_the_page(self, renderer, tmp_path, vase):
        need("nbclient", "ipykernel")
        import nbformat
        from nbclient import NotebookClient

        notebook = nbformat.read(EXAMPLES / "jupyter.ipynb", as_version=4)
        NotebookClient(notebook, timeout=120, resources={"metadata": {"path": tmp_path}}).execute()
        data = {cell.id: cell.outputs[-1].data for cell in notebook.cells if cell.cell_type == "code" and cell.outputs}
        light = ps.Light(position=vase.pivot + vase.pivot[2] * np.array([0.6, -0.5, -0.4]))
        from base64 import b64decode

        shown = {name: opened(io.BytesIO(b64decode(one["image/png"]))) for name, one in data.items() if name != "show"}
        assert not compare_images(shown["still"], ps.render(vase, light, yaw=15))
        assert not compare_images(shown["normals"], ps.render(vase, show="normals"))
        assert data["show"]["text/html"].startswith("<iframe srcdoc=") and len(data["show"]["text/html"]) < 3_000_000

    def test_it_is_stored_without_what_it_shows(self):
        cells = json.loads((EXAMPLES / "jupyter.ipynb").read_text())["cells"]
        assert not any(cell.get("outputs") or cell.get("execution_count") for cell in cells)

    @pytest.mark.system
    @pytest.mark.browser
    @pytest.mark.parametrize("name", ["jupyter", "canvas_notebook"])
    def test_in_jupyterlab_the_light_follows_the_mouse(self, renderer, page, tmp_path, request, name):
        need("jupyterlab", *(["anywidget", "rendercanvas"] if name == "canvas_notebook" else []))
        (tmp_path / f"{name}.ipynb").write_text((EXAMPLES / f"{name}.ipynb").read_text())
        labs = tmp_path / ".jupyter"  # no advice to build others' extensions, no question about news
        settings = "lab/user-settings/@jupyterlab/apputils-extension/notification.jupyterlab-settings"
        for file, text in (("labconfig/page_config.json", {"buildCheck": False}), (settings, {"fetchNews": "false"})):
            (labs / file).parent.mkdir(parents=True)
            (labs / file).write_text(json.dumps(text))
        options = ["--no-browser", "--allow-root", "--ip=127.0.0.1", "--port=0", "--IdentityProvider.token="]
        with served(tmp_path, *started("jupyterlab"), *options, f"--ServerApp.root_dir={tmp_path}") as address:
            opened_page = page(f"{address.split('/lab')[0]}/lab/tree/{name}.ipynb", 1100, 1000)
            opened_page.locator(".jp-Notebook-cell").first.wait_for(timeout=60_000)
            opened_page.get_by_text(re.compile(r"\| Idle")).first.wait_for(timeout=60_000)  # the kernel
            opened_page.locator(".lm-MenuBar-item", has_text="Run").click()
            opened_page.locator(".lm-Menu-item", has_text="Run All Cells").first.click()
            cell = opened_page.locator(".jp-OutputArea iframe" if name == "jupyter" else ".jp-OutputArea img").first
            cell.wait_for(timeout=60_000)
            (follows_the_mouse if name == "jupyter" else is_live)(opened_page, cell)
            screenshot(opened_page, request, name)
