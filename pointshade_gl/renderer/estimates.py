"""What is estimated of frames and clouds beside pictures: normals, albedo, poses."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import Progress, check_number, check_type
from ..gpu.context.context import Context
from ..notes.notes import Note, print_note, taken_by
from ..notes.words import option
from ..pipeline.pipeline import Pipeline
from ..scene.appearance import Appearance, SurfaceOptions
from ..scene.cloud import PointCloud
from ..scene.frame import Frame
from ..scene.noise import Method, check_method
from ..scene.objects import check_frames, uniform
from ..scene.option_fields import takes
from .requests import FilePath, RenderRequest

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ..estimation.pose_search import FoundPose
    from ..gpu.clouds.cloud_store import CloudNormals


class Estimates:
    """The methods of a Renderer that estimate normals, albedo and poses."""

    if TYPE_CHECKING:  # what the Renderer has
        context: Context
        _pipeline: Pipeline

        def _in_use(self) -> AbstractContextManager[None]: ...

    @takes(SurfaceOptions, Appearance)
    def estimate_normals(
        self, frame: Frame | PointCloud | FilePath | RenderRequest, method: Method = "auto", *,
        notes: Note | None = None, **options: Unpack[SurfaceOptions]
    ) -> NDArray[np.float32]:  # fmt: skip
        """Estimate the normals of a frame, or of its folder, or of a point cloud.

        Of a cloud the normals that it has are kept. The others point to its `seen_from`, to 0, 0, 0 where points are
        spread as a scanner there sees them, or else outwards; those of an open sheet, which has no outside, point up.
        Its only option is `noise`, in world units; without it the noise is measured. See `with_normals` for a cloud
        that has them.

        Parameters
        ----------
        frame : Frame, PointCloud, path or RenderRequest
            Whose normals.
        method : str, default "auto"
            "auto" measures the noise of the depth and chooses "star" (sharp at edges, for clean depth) or "adaptive"
            (planes as wide as the noise requires); where most depths are missing, as of LiDAR in a picture, "sparse"
            (planes across the gaps, noise or not). "star-borrow" is a little better and slower than "star". Classical:
            "triangles-1", "-2", "-4", "-8" (the mean over at most that many triangles), "central", "one-sided",
            "plane-fit-3" to "plane-fit-13".
        notes : callable, optional
            Called with one sentence for each note; None logs them ("pointshade_gl"), which prints them to stderr.

        Returns
        -------
        (h, w, 3) float32
            Unit normals, camera axes, towards the camera; NaN without depth, and where depths are so far apart that
            float32 has no normal for them. Of a cloud (n, 3), its own axes; NaN where its points lie on no surface.

        Raises
        ------
        ValueError
            For an unknown method and for invalid noise or step. `choice` says what ran, and why.
        """
        if isinstance(frame, PointCloud):
            normals = self._of_cloud(frame, method, dict(options), notes).normals
            normals[~normals.any(1)] = np.nan
            return normals
        if isinstance(frame, str | PathLike):
            from ..files.frames.frame_files import load_frame

            with taken_by(notes):
                frame = load_frame(frame)
        source = frame if isinstance(frame, RenderRequest) else check_type(frame, Frame, "frame")
        request = RenderRequest.of(source, normals=check_method(method), **options)
        frame = check_type(request.source, Frame, "frame")
        look = request.look.for_frame(frame.depth)
        with taken_by(notes), self._in_use():
            normals = self._pipeline.gpu_scene.read_normals(frame, look)[..., :3].copy()
        normals[~normals.any(-1)] = np.nan
        return normals

    def with_normals(self, cloud: PointCloud, *, noise: float | None = None, notes: Note | None = None) -> PointCloud:
        """Return a point cloud with normals and their confidence, see `estimate_normals`.

        Parameters
        ----------
        cloud : PointCloud
            Any; normals that it has are kept.
        noise : float, optional
            Standard deviation of the positions, world units; None measures it.
        notes : callable, optional
            As for `render`.

        Returns
        -------
        PointCloud
            The same otherwise; its normals are 0 where points lie on no surface.
        """
        found = self._of_cloud(check_type(cloud, PointCloud, "cloud"), "auto", {"noise": noise}, notes)
        return replace(cloud, normals=found.normals, confidence=found.confidence)

    def _of_cloud(self, cloud: PointCloud, method: Method, options: dict[str, Any], notes: Note | None) -> CloudNormals:
        from ..pipeline.gpu_scene import read_cloud_normals  # only here

        noise = options.pop("noise", None)
        if method != "auto" or options:
            given = next(iter(options), "method")
            raise ValueError(f"{option(given)} is for frames: of a point cloud leave it out")
        if noise is not None:
            noise = check_number(noise, option("noise"), 0)
        with taken_by(notes), self._in_use():
            return read_cloud_normals(self.context.gl, cloud, noise)

    def estimate_albedo(self, frames: Sequence[Frame]) -> NDArray[np.uint8]:
        """Estimate the albedo that several photographs of one view share, each under its own light.

        Their camera and what they show stay where they are; only the light moves. The lights are estimated from the
        photographs, and what one of them shows in shadow another may show lit. `explain` describes the lights. Relight
        the albedo as any picture: `Frame(albedo, frame.depth, frame.camera)`.

        Parameters
        ----------
        frames : sequence of Frame
            Two or more, with colours, of the same sizes and the same camera.

        Returns
        -------
        (h, w, 3) uint8
            sRGB, at the size of the colour pictures. One scale holds for the whole picture.

        Raises
        ------
        ValueError
            For fewer than two frames, for one without colours, and for frames of different sizes or cameras.
        """
        from ..scene.objects import check_photographs  # only here

        photos = check_photographs(frames)
        with self._in_use():
            return self._pipeline.gpu_scene.read_albedo(photos)

    @takes(SurfaceOptions, Appearance)
    def align_frames(
        self, frames: Sequence[Frame], *, search: bool = False, notes: Note | None = None,
        progress: Progress | None = None, **options: Unpack[SurfaceOptions]
    ) -> tuple[Frame, ...]:  # fmt: skip
        """Correct the poses of several frames of one thing, so that their depths and colours agree.

        The first frame keeps its pose. A given pose of a camera that looks belongs to the given poses: pass its frame
        among the others to have it corrected with them. `render([...], align=True)` does the same before it draws.

        Parameters
        ----------
        frames : sequence of Frame
            1 to 200, with poses that are right to about 10 cm and 3 degrees where things are 2 m away.
        search : bool
            Of 8 frames at most: their poses are unknown, but for the first one's. They are found if frames show enough
            of the same from up to about 60 degrees apart, at any roll and distance.
        notes : callable, optional
            Called with one sentence for each frame whose pose stays as given, in whole or in part: where it shares too
            little with the others, where no pose near the given one makes them agree, and for motions that neither
            depth nor colours fix, such as sliding along a plane. With `search`, for each that is not found, or may be
            wrong, and why.
        progress : callable, optional
            As for `render`: told of each frame that is read, each pair that is searched, and each of three levels.

        Returns
        -------
        tuple of Frame
            In the same order; frames share their arrays with the given ones.

        Raises
        ------
        TypeError, ValueError
            For anything but 1 to 200 frames, or 1 to 8 with `search`.
        Cancelled
            If `progress` returns False.

        Notes
        -----
        Pairs of frames are compared by how far the points of one lie off the planes of the other (Chen, Medioni 1991),
        and by their brightness (Park, Zhou, Koltun 2017); robust Gauss-Newton steps move all frames at once.
        """
        from ..pipeline.aligned_poses import Aligned, notes_on_search

        checked, look = check_frames(frames), uniform(Appearance(**options))
        with taken_by(notes), self._in_use():
            if not check_type(search, bool, "search"):
                return self._pipeline.align(checked, look, progress).frames
            found = self._pipeline.search(checked, look, progress)
            for text in notes_on_search(found):
                print_note(text)
            return Aligned.of(checked, [one.fit for one in found]).frames

    @takes(SurfaceOptions, Appearance)
    def align_sequence(
        self, frames: Iterable[Frame], *, notes: Note | None = None, **options: Unpack[SurfaceOptions]
    ) -> Generator[Frame, None, None]:
        """Yield the frames of a sequence with corrected poses, each as it comes, so that they do not drift.

        Parameters
        ----------
        frames : iterable of Frame
            In the order in which a camera took them. The first keeps its pose; the others' may be off by as much as
            the one before and a little more, or be all the same if the camera moves slowly.
        notes : callable, optional
            Called with a sentence where a frame fits none before it: then it is moved as the last one was.

        Yields
        ------
        Frame
            It shares its arrays with the given one.

        Raises
        ------
        TypeError
            For anything but frames, when it is reached.

        Notes
        -----
        Each frame is aligned, as by `align_frames`, to the three nearest of the last 16 keyframes. A frame that shares
        less than 70 % of its points with them becomes a keyframe.
        """
        from ..pipeline.aligned_poses import PoseTrack  # only here

        track = PoseTrack(self._pipeline.gpu_scene, uniform(Appearance(**options)))

        def follow() -> Generator[Frame, None, None]:
            for frame in frames:
                check_type(frame, Frame, "what the source gives")
                with taken_by(notes), self._in_use():
                    found = track.follow(frame)
                yield found

        return follow()

    def search_poses(self, frames: Sequence[Frame], progress: Progress | None = None) -> list[FoundPose]:
        """Find the poses of frames of one thing of which nothing is known, and say how sure they are.

        `align_frames(frames, search=True)` returns the frames at these poses.

        Parameters
        ----------
        frames : sequence of Frame
            1 to 8; the first keeps its pose.
        progress : callable, optional
            As for `align_frames`.

        Returns
        -------
        list of Found
            For each frame its fit, with its pose, and why it is doubtful or not found: nothing if it is sure.

        Raises
        ------
        TypeError, ValueError
            For anything but 1 to 8 frames.
        Cancelled
            If `progress` returns False.
        """
        checked = check_frames(frames)
        with self._in_use():
            return self._pipeline.search(checked, Appearance(), progress)
