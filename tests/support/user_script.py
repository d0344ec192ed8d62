"""What users write: each public name in use, as pyright and mypy see it. Lines with `# wrong` must be errors.

It is read, not run: see tests/test_user_types.py. What is made of a class is called like the class.
"""

from array import array
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.gltf import load_scene
from pointshade_gl.viewer import Event, Viewer


class Tensor:
    """As PyTorch declares its own."""

    def __array__(self, dtype: Any = None) -> Any: ...


class Capsule:
    """As the standard of arrays declares DLPack, and JAX, CuPy and PyTorch have it."""

    def __dlpack__(self, *, stream: Any = None, max_version: tuple[int, int] | None = None) -> Any: ...

    def __dlpack_device__(self) -> tuple[int, int]:
        return 1, 0


class Nothing:
    """No array at all."""


tensor, capsule, row, memory, nothing = Tensor(), Capsule(), array("f", [0, 0, 1]), memoryview(b"abcd"), Nothing()
image = Image.new("RGB", (2, 2))
folder, matrix = Path("folder"), np.eye(4)
rows = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
print(ps.__version__, ps.files.__name__)

# cameras and poses
camera = ps.Camera(500, 500.0, 319.5, 239.5, 640, 480)
wide = ps.Camera.from_fov(60, 640, 480)
rays, points = camera.rays(), camera.unproject(np.ones((480, 640), np.float32))
corner = camera.unproject([1.0, 2.0], pixels=[(0, 0), (639, 479)], pose=rows)
seen = camera.project([[0, 0, 1]], pose=matrix)
across, column = camera.ray_at(320, 240), camera.pixel_at(0.1, 0.2, 1.0)
smaller, fitted = camera.resized(320, 240), camera.fitted(100, 100)
numbers = [camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height, *camera.intrinsics]
turned = ps.orbit_pose(None, [0, 0, 2], yaw=10, pitch=-5.0, dolly=0.1, upright=(0, 1, 0))
moved = ps.orbit_pose(matrix, np.zeros(3), 10)

# frames
frame = ps.Frame(np.zeros((480, 640, 3), np.uint8), np.ones((480, 640)), camera, pose=rows, source="left")
plain = ps.Frame(None, [[1.0, 2.0], [3.0, 4.0]], camera)
color, depth, pose, name = frame.color, frame.depth, frame.pose, frame.source
own, larger, upright, itself_alone = frame.camera, frame.picture_camera, frame.upright, frame.frames
itself = frame.framed()
facts = frame.points_known, frame.is_sparse, frame.box, frame.depth_range, frame.scale
places = [frame.corners, frame.splat_corners(0.5), frame.main_corners, frame.pivot]
loaded = ps.load_frame("vase")
loaded = ps.load_frame(folder, allow_outside=True, max_pixels=1e8, notes=print)
loaded = ps.load_frame(color="color.png", depth=folder / "depth.png", intrinsics="500,500,320,240", depth_scale=1000)
loaded = ps.load_frame(depth=np.ones((2, 2)), color=[[[0, 0, 0]]], intrinsics=(500, 500, 320, 240), pose=matrix)
loaded = ps.load_frame(folder, poses="poses.json", projection="equirectangular")
loaded = ps.load_frame(depth="depth.npy", fov=60, depth_kind="disparity", baseline=0.1, pose="pose.txt")
loaded = ps.load_frame(depth="depth.npy", fov=60, depth_kind="buffer", near=0.1, far=100, channel="0")

tensors = ps.Frame(tensor, capsule, camera, pose=tensor), ps.Frame(image, memory, camera), frame.at(capsule)
loaded = ps.load_frame(depth=capsule, color=image, intrinsics=tensor, pose=capsule)
seen, points = camera.project(tensor, pose=capsule), camera.unproject(capsule, pixels=tensor)

# lights, materials, looks, views
light = ps.Light(position=[0, 0, 1], direction=np.array([0, 0, 1]), color=(1, 0.9, 0.8), shadow=True)
sun = ps.Light(direction=(0, 1, 0), intensity=2, attenuation=[1, 0, 0], cone=[10, 20], radius=0, angle=0.53)
lamp = ps.Light([0, 0, 1], watts=100), ps.Light([0, 0, 1], candela=50, falloff="none"), ps.Light(lux=3)
panel = ps.Light((0, 0, 1), (0, 0, 1), size=[0.5, 0.2], falloff="inverse-square")
lamps = ps.Light(tensor), ps.Light(direction=capsule, color=row, cone=memory)
held = ps.Appearance(normals=tensor, point_size=capsule, noise=tensor), ps.OutputSettings(background=row, ground=tensor)
of_light = light.position, light.direction, light.color, light.intensity, light.attenuation, light.cone
switches = light.shadow, light.radius, light.angle, light.is_spot, light.is_soft, light.is_area, light.size
material = ps.Material(ambient=0.2, diffuse=1, specular=0, shininess=10)
strengths = material.ambient, material.diffuse, material.specular, material.shininess, material.strengths
appearance = ps.Appearance(
    material, normals="star", shading="flat", point_size="fill", splat="mesh", max_depth_step="3%"
)
other = ps.Appearance(
    noise="kinect", upsample="none", normals_at="target", flying="snap", missing="photo", temporal=True
)
other = ps.Appearance(
    normals=np.zeros((2, 2, 3)), point_size=[[1, 2]], noise=0.01, unlight=True, remove_highlights=True
)
of_look = (
    appearance.material,
    appearance.shading,
    appearance.splat,
    appearance.upsample,
    appearance.normals_at,
    appearance.flying,
    appearance.missing,
)
values = appearance.normals, appearance.point_size, appearance.max_depth_step, appearance.depth_step, appearance.noise
asked = appearance.temporal, appearance.unlight, appearance.remove_highlights, appearance.align
checks = (
    appearance.has_own_sizes,
    appearance.is_uniform,
    appearance.fills,
    appearance.completes,
    appearance.farthest_reach,
    appearance.is_plain,
    appearance.finds_light,
)
looks = [appearance.alone, appearance.as_taken, appearance.of_points, appearance.for_frame(frame.depth)]
sizes, options = appearance.sizes_for(frame.depth), appearance.options
output_settings = ps.OutputSettings(16, "white", ground=True, ground_height=-1.2)
mixed = (
    ps.OutputSettings(background=(0, 0, 1), ground=[0, 1, 0]),
    ps.OutputSettings(background=np.ones(3), ground=np.ones(3)),
)
shown_as, no_light, of_passes, near, is_light = (
    ps.OutputSettings(show="depth"),
    output_settings.of_numbers,
    output_settings.of_passes,
    output_settings.near,
    (output_settings.is_light, output_settings.show),
)
of_finish = (
    output_settings.samples,
    output_settings.background,
    output_settings.ground,
    output_settings.ground_height,
    output_settings.exposure,
    output_settings.fill,
)
vectors, changed, plainly = (
    (output_settings.behind, output_settings.up),
    output_settings.options,
    output_settings.is_plain,
)
brighter = ps.OutputSettings(exposure=1.5, tone="neutral"), ps.OutputSettings(exposure="auto"), output_settings.tone
environment = ps.Environment(np.ones((4, 8, 3)), name="dim")
environments = [ps.load_environment(folder / "studio.hdr", max_pixels=1e8), ps.Environment([[[1, 1, 1]]])]
skies = environment.of("studio"), ps.Environment.of("sky"), environment.picture[0, 0], environment.name
around = ps.OutputSettings(environment="sky", environment_intensity=2, environment_rotation=90, ambient_occlusion=True)
others = ps.OutputSettings(environment=environment, environment_rotation=np.eye(3), ambient_occlusion=0.2)
of_around = (
    output_settings.environment,
    output_settings.environment_intensity,
    output_settings.environment_rotation,
    output_settings.ambient_occlusion,
)
view = ps.View([light], matrix, picture_size="half", look=appearance, finish=output_settings)
views = ps.View((light, sun), yaw=10, pitch=5, dolly=0.1, picture_size=(640, 480)), ps.View(pose=rows)
of_view = view.lights, view.pose, view.yaw, view.pitch, view.dolly, view.picture_size, view.look, view.finish
arguments = view.of(frame, pivot=[0, 0, 1])
who, where = view.seen(frame)
photograph = view.shows_photograph([frame, frame])

# meshes and scenes
mesh = ps.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], color=[1, 0, 0], shading="gouraud")
tinted = ps.Mesh(mesh.positions, mesh.faces, colors=np.zeros((3, 3), "u1"), up="z"), mesh.colors, mesh.up
box = ps.Mesh(np.zeros((3, 3)), np.zeros((1, 3), int), np.ones((3, 3)), [(0, 0)] * 3, texture=np.zeros((1, 1, 3), "u1"))
made = ps.Mesh(tensor, capsule, texture=image), ps.PointCloud(capsule, colors=tensor), ps.Environment(capsule)
moved_node = ps.Node(transform=tensor)
of_mesh = mesh.positions, mesh.faces, mesh.normals, mesh.uv, mesh.texture, mesh.corners
kept = mesh.color, mesh.material, mesh.shading
point_object = ps.PointObject(frame, splat="round", normals=np.zeros((2, 2, 3)))
several = ps.PointObject([frame, plain], look=appearance), ps.PointObject(frame, material, others=(plain,))
of_object = point_object.frame, point_object.look, point_object.others, point_object.frames, point_object.members
counts = point_object.is_single, point_object.clouds, point_object.points_known, point_object.scale
of_frames = point_object.shading, point_object.material, point_object.is_alike_from_everywhere
of_boxes = point_object.corners, point_object.main_corners, point_object.pose_in_node, point_object.up_direction
of_drawn = mesh.main_corners, mesh.pose_in_node, mesh.up_direction, mesh.frames, mesh.clouds, mesh.is_single
node = ps.Node(point_object, "vase", rows, [ps.Node(light)], visible=True, shadow=False)
group = ps.Node([mesh, light], transform=matrix, children=(node,)), ps.Node((mesh, light)), ps.Node()
of_node = node.content, node.name, node.transform[:3, 3], node.children, node.visible, node.shadow, node.title
scene = ps.Scene([node], camera, pose=rows, ambient=[1, 1, 1])
empty = ps.Scene(), ps.Scene((node, *group), None, matrix, np.ones(3), environment)
below_a_sky = ps.Scene(environment="sky"), ps.Scene(environment=np.ones((4, 8, 3))), scene.environment
of_scene = scene.nodes, scene.camera, scene.pose[:3, 3], scene.ambient, scene.bounds, scene.extent, scene.scale
lights, names, boxes = scene.lights, scene.light_names, scene.boxes
placed, instances, count = list(scene.placed()), scene.instances, scene.points_known
no_frames, of_pictures = scene.frames, scene.picture_camera
framed, pivot, upright = scene.framed(), scene.pivot, scene.upright
hidden = scene.with_node((0, 1), visible=False, transform=matrix)
bare = scene.with_every_node(lambda each: {"shadow": each.name != "floor"})
for path, below in scene.every_node():
    print(path, below)

# pictures
picture = ps.render(frame)
picture = ps.render("vase", light, material, camera, matrix, "adaptive", "none", 2)
picture = ps.render(
    [frame, plain], [light, sun], pose=rows, normals=np.zeros((2, 2, 3)), point_size=[[1, 2]], samples=4
)
picture = ps.render(scene, samples=16, background="#102030", ground=(0, 1, 0), ground_height=0.1)
picture = ps.render(folder, yaw=10, pitch=5, dolly=0.1, splat="footprint", noise="1.5mm", background=[0, 0, 1])
picture = ps.render(frame, environment=folder / "a.hdr", environment_rotation=30, ambient_occlusion=False)
picture = ps.render(scene, environment="studio.exr", environment_intensity=0.5, ambient_occlusion=0.1)
picture = ps.render(frame, temporal=True, unlight=True, remove_highlights=True, flying="keep", max_depth_step=0.05)
picture = ps.render(frame, out=np.zeros((480, 640, 4), np.uint8), normals=tensor, pose=capsule)
picture = ps.render(frame, out=tensor, environment=tensor)
shapes = ps.render(frame, out=capsule).shape, ps.render(frame, out=memory).shape
layers = ps.render_passes(scene, [light, sun], passes=["beauty", "light"], samples=2, environment="sky", notes=print)
ps.save_passes(folder / "passes.exr", layers)
of_layers = layers["light_1"].max(), layers.camera.width, layers.pose.shape, layers.objects[0]
picture_depth = ps.render_depth(frame, camera, np.eye(4), "star", upsample="vote")
picture_normals = ps.render_normals([frame, plain], yaw=20, noise="2mm"), ps.render_normals(scene)
normals = ps.estimate_normals(frame, "plane-fit-5", noise=0.01, max_depth_step="3%", flying="snap")
albedo = ps.estimate_albedo([frame, plain])
elsewhere = frame.at(rows)
standing = frame.with_up((0, 0, 1)).upright, frame.up, ps.Frame(None, plain.depth, camera, up=(0, -1, 0))
turning = frame.with_up((0, 0, 1), about=(0, 0, 2)), frame.turning_as(frame), frame.about
corrected = ps.align_frames([frame, plain], noise="kinect", progress=lambda done, every: done < every)
ps.save_poses(folder / "poses.txt", corrected, numbers=[0, 7])
point_cloud = ps.render_points(folder, light, shading="none", pose=rows)
meshes = ps.render_mesh([frame, plain], light, align=True, pose=rows).nodes
cloud = ps.PointCloud([(0, 0, 0)], np.ones((1, 3)), np.zeros((1, 3), np.uint8))
of_cloud = point_cloud.positions, point_cloud.normals, point_cloud.colors, len(point_cloud)
scanned = ps.load_cloud("scan.laz", up="z", most=1_000_000, color_by="class", max_pixels=1e8, notes=print)
scanned = ps.load_cloud(folder / "scan.ply", crop=((-1, -1, 0), (1, 1, 2)), clean=True, seen_from=(0, 0, 1.7))
scanned = ps.load_cloud(folder / "scan.ply", color_range=(0, 1), columns="x,y,z,label", all_points=True)
of_points = point_cloud.sizes, point_cloud.confidence, point_cloud.origin, point_cloud.up, point_cloud.seen_from
of_drawing = point_cloud.material, point_cloud.shading, point_cloud.splat, point_cloud.point_size
of_place = (
    point_cloud.corners,
    point_cloud.main_corners,
    point_cloud.main_points,
    point_cloud.radius_rule,
    point_cloud.rough_spacing,
    point_cloud.up_direction,
)
of_levels = point_cloud.front, point_cloud.points_known, point_cloud.thins, point_cloud.arrays, point_cloud.reach(0.5)
gaussians = ps.Gaussians(np.ones((1, 3)), np.ones((1, 4)), np.ones(1), np.ones((1, 3)), None, antialiased=True)
trained = ps.PointCloud([(0, 0, 0)], gaussians=gaussians, splat="gaussian", shading="auto")
of_trained = point_cloud.gaussians, point_cloud.is_gaussian, point_cloud.as_discs, point_cloud.stray, trained
of_gaussians = gaussians.scales, gaussians.rotations, gaussians.opacities, gaussians.base, gaussians.harmonics
of_splats = gaussians.antialiased, gaussians.degree, gaussians.covariances, gaussians.colors, gaussians.median_length
turned_splats = gaussians.select(np.zeros(1, np.int64)), gaussians.as_discs(), gaussians.turned(np.eye(3))
balls = point_cloud.styled(splat="ball", point_size="3px", shading="edl")
is_like = point_cloud.is_like(balls)
of_nodes = point_cloud.frames, point_cloud.clouds, point_cloud.is_single, point_cloud.pose_in_node
anything = ps.sources.load_any(folder / "scan.pcd", up="-y", most=None)
with ps.Renderer(device=0, rasterizer="points", merge=0) as renderer:
    drawn = renderer.render(scene, [light], samples=2)
    texture = renderer.draw(frame, light, shading="gouraud")
    every_layer = renderer.render_passes(folder, passes="all", yaw=10, progress=lambda done, every: None)
    maps = renderer.render_depth(frame), renderer.render_normals(scene), renderer.estimate_normals(frame)
    lit = renderer.render_points([frame, plain], progress=lambda done, every: None)
    surfaces = renderer.render_mesh(folder, light, shading="none", notes=print)
    oriented = renderer.with_normals(point_cloud, noise=0.01, notes=print)
    hit = renderer.find_surface(320, 240, camera, matrix, reach=2)
    surface, colored = renderer.read_surface(320, 240, camera, matrix), renderer.color_scale
    lines, choice, shares = renderer.explain(["a", "b"]), renderer.choice, renderer.weights
    aligned, poses = renderer.aligned, renderer.align_frames([frame, plain], max_depth_step="3%")
    doubts = [one.doubt for one in renderer.search_poses([frame, plain])]
    steady = [one.pose for one in renderer.align_sequence([frame, plain], notes=print, noise="kinect")]
    stops, share, nearby = renderer.exposure, renderer.fill, renderer.surroundings
    shared = renderer.estimate_albedo([frame, plain])
    driver, steps = renderer.context.renderer, renderer.steps
    with renderer.prepared(scene, camera, matrix) as drawables:
        print(drawables)
    renderer.release()
with ps.RendererPool(2, device=0, rasterizer="points") as renderer_pool:
    filled = renderer_pool.render(frame, out=picture), renderer_pool.submit(frame, out=tensor)
    waited, future = renderer_pool.render(frame, light, yaw=10.0), renderer_pool.submit(scene, samples=2)
    awaited = renderer_pool.render_async(folder, shading="flat")
    print(waited.shape, future.result().shape)
    renderer_pool.release()
ps.use_device(0)
ps.release()
try:
    watched = ps.render(frame, samples=4, notes=print, progress=lambda done, of: done < 3)
except ps.Cancelled as error:
    print(error)
try:
    cell = ps.show(frame, height=300, quality="small", shading="phong")
except (ps.ContextError, ps.ShaderError) as error:
    print(error)

# files
ps.save_image("out.png", picture, small=True)
ps.save_image(folder / "list.png", [[[0, 0, 0]]])
ps.save_depth("out.exr", frame.depth, notes=print)
ps.save_image("out.png", image)
ps.save_depth("out.exr", capsule)
ps.save_normals("out.npy", tensor)
ps.save_normals(folder / "normals.png", normals, axes="directx", bits=16)
ps.save_points("out.ply", point_cloud, axes="blender")
ps.save_page("out.html", scene, quality="exact", largest=512, title="A scene", light=light)
ps.save_scene("out.glb", scene)
ps.gltf.save_scene(folder / "out.gltf", scene)
demo = ps.load_scene("demo", allow_outside=True, max_pixels=1e8, notes=print)
demo = ps.gltf.load_scene(folder / "scene.gltf")
same = load_scene("demo").nodes
demo = ps.load_scene(folder / "mesh.ply", up="z")
with ps.Film(folder / "film.mp4", fps=30) as film:
    film.add(picture)
    film.add(tensor)
    film.add([[[0, 0, 0]]])
film.close()
film.discard()

# sequences and streams
source = ps.open_source("folder", depth_scale=5000, depth_kind="z", pose=None, notes=print)
source = ps.sources.open_source(folder)
frames = [source] if isinstance(source, ps.Frame) else source[10:20]
for one in ps.prefetched(frames, print, ahead=4):
    print(one)
for one in ps.sources.prefetched([frame], print):
    print(one)
for together in ps.live_set([frame, [frame], source], print):
    print(together[0].depth)
for together in ps.live.live_set((frame,)):
    print(together)
loaded_any = ps.sources.load_any("demo", max_pixels=1e8)
merged = ps.sources.views_of(source, 8), ps.sources.choose_views([frame, plain], [0, 1])
is_scene = ps.sources.is_scene("scene.glb")
ps.sources.check_posed([source])
real_sense_source = ps.RealSenseSource((640, 480), fps=30)
for one in real_sense_source:
    print(one, real_sense_source.camera)
real_sense_source.close()

# batches and the window
if __name__ == "__main__":
    for result in ps.batch.map("folder", appearance, view, workers=2, device=0):
        print(result)
    for result in ps.batch.map(["a", folder, frame, [frame, plain], scene], ray="local", num_gpus=0.25):
        print(result.shape)
    for result in ps.batch.map([frame], progress=lambda done, every: done < every, notes=print):
        print(result.shape)
    for outcome in ps.batch.map([frame], return_exceptions=True):
        print(outcome)
    stage = ps.batch.Stage(appearance, view, camera)
    rows_drawn = stage({"path": ["a", "b"]})
event = Event("key", "N")
viewer = Viewer(source, title="a", window_size=(640, 480), lights=[light], others=[frames], fps=[30, None], views="all")
viewer.run()
with_mouse = ps.canvas(frame, "offscreen", window_size=(320, 240), place=ps.View(yaw=20))
with_mouse.send({"event_type": "pointer_move", "x": 10.0, "y": 20})
with_mouse.state = with_mouse.state.with_light_direction((1, 0, 0.5))
with_mouse.run()

ps.rendr(frame)  # wrong
ps.render(frame, out="out.png")  # wrong
ps.render(frame, out=nothing)  # wrong
ps.render(frame, normals=nothing)  # wrong
ps.render_depth(frame, out=picture)  # wrong
ps.Frame(nothing, frame.depth, camera)  # wrong
ps.Light(position=nothing)  # wrong
ps.save_image("out.png", nothing)  # wrong
ps.batch.mapp([frame])  # wrong
ps.gltf.load("demo")  # wrong
ps.files.load_frame("vase")  # wrong
ps.render(frame, shading="fong")  # wrong
ps.render(frame, normals="best")  # wrong
ps.render(frame, splat="star")  # wrong
ps.render(frame, point_size=print)  # wrong
ps.render(frame, upsample="no")  # wrong
ps.render(frame, normals_at="frame")  # wrong
ps.render(frame, flying="snp")  # wrong
ps.render(frame, flyng="snap")  # wrong
ps.render(frame, background=3)  # wrong
ps.render(frame, ground="down")  # wrong
ps.render(frame, samples="many")  # wrong
ps.render(frame, environment=3)  # wrong
ps.render(frame, ambient_occlusion="yes")  # wrong
ps.Environment("sky")  # wrong
ps.Environment.of("night")  # wrong
ps.Scene(environment="night")  # wrong
ps.render(frame, camera="wide")  # wrong
ps.render(frame, light="sun")  # wrong
ps.render(3)  # wrong
ps.render_depth(frame, samples=2)  # wrong
ps.render_normals(frame, samples=2)  # wrong
ps.render_passes(frame, tone="neutral")  # wrong
ps.render_depth(frame, normals="best")  # wrong
ps.render_points(frame, shading="fong")  # wrong
ps.estimate_normals(frame, "magic")  # wrong
ps.estimate_normals(frame, nois=1)  # wrong
ps.Appearance(normals="best")  # wrong
ps.Appearance(shading="fong")  # wrong
ps.Appearance(flyng="snap")  # wrong
ps.Material(shinines=3)  # wrong
ps.OutputSettings(background=3)  # wrong
ps.OutputSettings(exposure="bright")  # wrong
ps.View(picture_size="quarter")  # wrong
ps.View(light)  # wrong
ps.Light(positon=[0, 0, 1])  # wrong
ps.Light("above")  # wrong
ps.PointObject(frame, splat="star")  # wrong
ps.Mesh("positions", "faces")  # wrong
ps.Mesh(mesh.positions, mesh.faces, shading="fong")  # wrong
ps.Node(frame)  # wrong
ps.Scene(node)  # wrong
ps.Frame(None, frame.depth)  # wrong
ps.Renderer(rasterizer="gpu")  # wrong
renderer.render(frame, shading="fong")  # wrong
renderer.draw(frame, shadng="flat")  # wrong
renderer_pool.submit(frame, shading="fong")  # wrong
ps.RendererPool(rasterizer="gpu")  # wrong
scene.with_node((0,), visibel=False)  # wrong
camera.unprojekt(frame.depth)  # wrong
ps.load_frame("vase", depth_kind="zed")  # wrong
ps.load_frame("vase", projection="sphere")  # wrong
ps.load_frame("vase", depht_scale=5000)  # wrong
ps.open_source("folder", depth_kind="zed")  # wrong
ps.open_source("folder", depht_scale=5000)  # wrong
ps.load_scene("demo", note=print)  # wrong
ps.save_normals("normals.png", normals, axes="blender")  # wrong
ps.save_normals("normals.png", normals, bits=12)  # wrong
ps.save_page("out.html", frame, quality="tiny")  # wrong
ps.save_page("out.html", frame, shadng="flat")  # wrong
ps.show(frame, quality="tiny")  # wrong
ps.batch.map([frame], worker=2)  # wrong
ps.batch.map([3])  # wrong
ps.live_set(frame)  # wrong
Viewer(frame, views="some")  # wrong
Viewer(frame, size=(640, 480))  # wrong
ps.canvas(3)  # wrong
Event("click")  # wrong
print(picture.shpe)  # wrong
