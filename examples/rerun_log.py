"""rerun recording.

Log a frame: colour, depth, camera, normals, and its points while a light goes round them.

Install::

    pip install pointshade-gl rerun-sdk

`python rerun_log.py [FOLDER]` writes rerun_log.rrd; `rerun rerun_log.rrd` shows it.
"""

import sys

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

import pointshade_gl as ps

LIGHTS = 12
frame = ps.load_frame(*sys.argv[1:2] or ["vase"])
camera, pose = frame.camera, frame.pose
distance = float(np.linalg.norm(frame.pivot - pose[:3, 3]))


def place(right, down, forward):
    """From the middle of the frame, in units of its distance; in the world."""
    return frame.pivot + distance * (pose[:3, :3] @ (right, down, forward))


rr.init("pointshade")
rr.save("rerun_log.rrd")
# Our axes are those of OpenCV, which rerun calls RDF: x right, y down, z forward. Poses are camera-to-world in both.
rr.log("world", rr.ViewCoordinates.RDF, static=True)
rr.log("world/camera", rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3]), static=True)
pinhole = rr.Pinhole(
    focal_length=(camera.fx, camera.fy),
    principal_point=(camera.cx + 0.5, camera.cy + 0.5),  # rerun counts from the corner of a pixel, we from its centre
    resolution=(camera.width, camera.height),
    camera_xyz=rr.ViewCoordinates.RDF,
    image_plane_distance=0.3 * frame.depth_range[0],
)
rr.log("world/camera", pinhole, static=True)
rr.log("world/camera/depth", rr.DepthImage(frame.depth, meter=1.0), static=True)
if frame.color is not None:
    rr.log("world/camera/color", rr.Image(frame.color), static=True)

cloud = ps.render_points(frame, shading="none")
radius = 0.7 * distance / camera.fx  # of a pixel
rr.log("world/points", rr.Points3D(cloud.positions, radii=radius), static=True)
some = slice(None, None, max(1, len(cloud.positions) // 1500))
arrows = rr.Arrows3D(origins=cloud.positions[some], vectors=0.03 * distance * cloud.normals[some], radii=0.6 * radius)
rr.log("world/normals", arrows, static=True)

for k, angle in enumerate(np.linspace(0, 2 * np.pi, LIGHTS, endpoint=False)):
    position = place(0.5 * np.sin(angle), -0.5 * np.cos(angle), -0.4)
    rr.set_time("light", sequence=k)
    rr.log("world/light", rr.Points3D([position], radii=0.02 * distance, colors=[(255, 220, 120)]))
    rr.log("world/points", rr.Points3D.from_fields(colors=ps.render_points(frame, ps.Light(position=position)).colors))

eye = rrb.EyeControls3D(position=place(0.5, -0.3, -0.9), look_target=frame.pivot, eye_up=-pose[:3, 1])
space = rrb.Spatial3DView(origin="world", contents=["world/**", "- world/camera/depth"], eye_controls=eye)
pictures = [rrb.Spatial2DView(origin="world/camera", contents=f"$origin/{name}") for name in ("color", "depth")]
views = rrb.Horizontal(space, rrb.Vertical(*pictures), column_shares=[2, 1])
rr.send_blueprint(rrb.Blueprint(views, collapse_panels=True))
print(f"rerun_log.rrd: {len(cloud.positions)} points under {LIGHTS} lights. Now type: rerun rerun_log.rrd")
