"""What a Renderer keeps, for how long, and how it ends: threads, forks, many pictures, release."""

import asyncio
import gc
import multiprocessing
import subprocess
import sys
import threading
import weakref
from contextlib import nullcontext
from pathlib import Path

import moderngl
import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene import shadow_cameras

from .test_renderer import living_objects

STATM = Path("/proc/self/statm")


def small(seed=0, width=16, height=12):
    """A frame of random colours and depths that nobody else holds."""
    random = np.random.default_rng(seed)
    color = random.integers(0, 255, (height, width, 3), np.uint8)
    return ps.Frame(
        color, random.uniform(1, 2, (height, width)), ps.Camera(20, 20, width / 2, height / 2, width, height)
    )


def scene_of(content):
    return ps.Scene(tuple(ps.Node(ps.PointObject(frame)) for frame in content), camera=small().camera)


def megabytes():
    return int(STATM.read_text().split()[1]) * 4096 / 1e6


def alive(renderer):
    with renderer.context.in_use():
        return living_objects(renderer.context.gl)


@pytest.mark.system
@pytest.mark.skipif(not STATM.exists(), reason="memory is counted by /proc")
def test_threads_that_end_free_their_renderers(renderer):
    def run(count):
        for seed in range(count):
            thread = threading.Thread(target=ps.render, args=(small(seed),))
            thread.start()
            thread.join()

    held = []
    for _ in range(7):
        run(20)
        held.append(megabytes())
    # Each holds 10 while it lives. malloc takes an arena of 45 once in a while, and several at first, beside workers.
    assert np.median(np.diff(held)[-3:]) < 10


@pytest.mark.system
@pytest.mark.parametrize(
    "code",
    [
        "ps.render(f)",
        "t = threading.Thread(target=ps.render, args=(f,)); t.start(); t.join(); ps.render(f)",
        "threading.Thread(target=lambda: (ps.render(f), done.set(), time.sleep(99)), daemon=True).start(); done.wait()",
        "pool = ThreadPoolExecutor(2); [each.result() for each in [pool.submit(ps.render, f) for _ in range(4)]]",
        "pool = ps.RendererPool(2); pool.render(f)",
        "r = ps.Renderer(); r.render(f)",
        "r = ps.Renderer(); r.render(f); ps.render(f); sys.exit(0)",
    ],
)
def test_a_process_ends_in_silence(renderer, code):
    names = "import sys, threading, time; from concurrent.futures import ThreadPoolExecutor; import pointshade_gl as ps"
    frame = "import numpy as np; f = ps.Frame(None, np.ones((4, 4)), ps.Camera(4, 4, 2, 2, 4, 4))"
    done = subprocess.run(
        [sys.executable, "-X", "dev", "-c", f"{names}; {frame}; done = threading.Event(); {code}"],
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_twenty_copies_of_a_frame_leave_one(renderer):
    frame = small()
    with ps.Renderer() as renderer:
        alone = renderer.render(frame)
        before = alive(renderer)
        renderer.render(scene_of([frame] * 20))
        assert alive(renderer)["Texture"] >= before["Texture"] + 19
        assert (renderer.render(frame) == alone).all()
        assert len(renderer._pipeline.gpu_scene.frames._kept) == 1
        many = alive(renderer)
        renderer.render(scene_of([frame] * 20))
        renderer.render(frame)
        assert alive(renderer) == many


def test_copies_that_stay_are_not_uploaded_again(renderer):
    frame, other = small(), small(1)
    renderer.render(scene_of([frame, other, frame]))
    before = renderer.steps.counts.copy()
    renderer.render(scene_of([frame, other, frame]), light=ps.Light(position=(1, 0, 0)))
    renderer.render(scene_of([frame, other]))
    counts = renderer.steps.counts - before
    assert (counts["upload"], counts["surface"]) == (0, 0)


@pytest.mark.parametrize("options", [{}, {"samples": 2, "ground": (0, -1, 0)}], ids=["plain", "finished"])
def test_frames_meshes_and_clouds_that_are_no_longer_shown_are_let_go(renderer, options):
    corners = np.array([[-0.5, -0.5, 1.2], [0.5, -0.5, 1.2], [0, 0.5, 1.2]])
    content = [small(seed) for seed in range(20)]
    mesh = ps.Mesh(corners, np.array([[0, 1, 2]]))
    cloud = ps.PointCloud(np.random.default_rng(0).uniform(1, 3, (200, 3)))
    refs = [*map(weakref.ref, content), weakref.ref(mesh), weakref.ref(cloud)]
    scene = scene_of(content)
    scene = ps.Scene((*scene.nodes, ps.Node(mesh), ps.Node(cloud)), camera=scene.camera)
    renderer.render(scene, ps.Light(direction=(0, 0, 1), shadow=True), **options)
    del content, mesh, cloud, scene
    renderer.render(small(99))
    gc.collect()
    assert [ref() for ref in refs if ref() is not None] == []


class TestRelease:
    @pytest.fixture
    def context(self, renderer):
        context = moderngl.create_context(standalone=True, backend="egl")
        yield context
        context.release()

    @pytest.fixture(params=["own", "borrowed"])
    def made(self, request, context):
        return ps.Renderer(context if request.param == "borrowed" else None)

    def test_twice_is_once(self, made):
        made.render(small())
        made.release()
        made.release()

    def test_inside_of_with(self, made):
        with made:
            made.render(small())
            made.release()

    @pytest.mark.parametrize(
        "call",
        [
            lambda r: r.render(small()),
            lambda r: r.draw(scene_of([small()])),
            lambda r: r.estimate_normals(small()),
            lambda r: r.__enter__(),
        ],
    )
    def test_use_afterwards_is_one_clear_error(self, made, call):
        made.render(small())
        made.release()
        with pytest.raises(ps.ContextError, match=r"^this Renderer was released: make a new one$"):
            call(made)
        assert made.steps.counts["upload"] == 1

    def test_a_context_that_its_owner_has_released(self, context):
        made = ps.Renderer(context)
        made.render(small())
        context.release()
        with pytest.raises(ps.ContextError, match="the moderngl context of this Renderer was released"):
            made.render(small())
        made.release()
        made.release()

    def test_an_error_inside_of_with_is_the_one_that_is_seen(self, made):
        with pytest.raises(KeyError), made:
            raise KeyError

    def test_nothing_is_left_of_a_renderer_that_could_not_be_made(self, context):
        code = context.version_code
        try:
            context.version_code = 330
            with pytest.raises(ps.ContextError, match=r"needs OpenGL 4\.3"):
                ps.Renderer(context, rasterizer="compute")
            context.version_code = 320
            with pytest.raises(ps.ContextError, match=r"OpenGL 3\.3 is needed, .* offers 3\.2"):
                ps.Renderer(context)
        finally:
            context.version_code = code
        with ps.Renderer(context) as renderer:
            assert renderer.render(small()).any()


def _render_anew(work, answers):
    try:
        picture = ps.render(small()) if work == "render" else ps.Renderer().render(small())
        answers.put(str(picture.shape))
    except ps.ContextError as error:
        answers.put(str(error))


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.parametrize(
    ("work", "start", "answer"),
    [
        ("render", "fork", "multiprocessing.get_context('spawn')"),
        ("Renderer", "fork", "OpenGL was used before a fork, and hangs after it: start processes by spawn"),
        ("render", "spawn", "(12, 16, 4)"),
        ("Renderer", "spawn", "(12, 16, 4)"),
    ],
)
def test_a_new_renderer_in_another_process(renderer, work, start, answer):
    """In one that was forked the driver would wait for ever for its threads."""
    context = multiprocessing.get_context(start)
    answers = context.Queue()
    child = context.Process(target=_render_anew, args=(work, answers), daemon=True)
    child.start()
    said = answers.get(timeout=20)
    child.join()
    assert answer in said


def _use_in_child(kind, used, answers):
    """What a child process is told that goes on with something of its parent's, and that it can leave it."""
    try:
        match kind:
            case "submit":
                used.submit(small())
            case "render":
                used.render(small())
            case "render_async":
                asyncio.run(used.render_async(small()))
            case _:
                next(used)
        answers.put("nothing")
    except ps.ContextError as error:
        answers.put(str(error))
    used.release() if isinstance(used, ps.RendererPool) else used.close()
    answers.put("left")


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.parametrize("kind", ["submit", "render", "render_async", "prefetched", "live set"])
def test_what_owns_threads_is_refused_in_a_fork_instead_of_hanging(renderer, kind):
    frames = [small(seed) for seed in range(9)]
    started = {"prefetched": lambda: ps.prefetched(frames, print), "live set": lambda: ps.live_set([frames])}
    with nullcontext() if kind in started else ps.RendererPool() as pool:
        used = pool or started[kind]()
        assert used.render(small()).any() if pool else next(used)
        fork = multiprocessing.get_context("fork")
        answers = fork.Queue()
        child = fork.Process(target=_use_in_child, args=(kind, used, answers), daemon=True)
        child.start()
        assert "was made before a fork: start processes by spawn" in answers.get(timeout=20)
        assert answers.get(timeout=20) == "left"
        child.join()
        assert used.render(small()).any() if pool else next(used)
    if kind in started:
        used.close()


@pytest.mark.parametrize("splat", ["disc", "ball"])
def test_a_cloud_that_is_no_longer_drawn_leaves_nothing_on_the_gpu(renderer, monkeypatch, splat):
    """Neither its points nor what found their planes; however often it comes again."""
    monkeypatch.setattr(shadow_cameras, "SHADOW_SIDE", 128)
    points = np.random.default_rng(0).uniform((-1, -1, 3), (1, 1, 5), (1000, 3))
    view = {"camera": ps.Camera(60, 60, 39.5, 29.5, 80, 60), "pose": np.eye(4)}
    with ps.Renderer() as renderer:
        held = []
        for _ in range(3):
            renderer.render(ps.PointCloud(points, splat=splat), ps.Light(direction=(0, 1, 1), shadow=True), **view)
            drawn = alive(renderer)
            renderer.render(ps.PointCloud(points, splat=splat).styled(point_size="5px"), **view)
            renderer.render(small())
            held.append(alive(renderer))
        assert held[0] == held[1] == held[2] and drawn["Buffer"] > held[0]["Buffer"]
