"""The options that commands share: one annotated type each, named as in the help."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

FRAME, LIGHT, VIEW, FILM = "Frame", "Light and surface", "View", "Film"
Input = Annotated[
    str | None,
    typer.Argument(
        metavar="[INPUT]",
        help="A folder with color.*, depth.*, intrinsics.json, or with many of them; "
        "'vase' (the default); for render and view also a scene: .gltf, .glb or 'demo'.",
    ),
]
Color = Annotated[str | None, typer.Option(help="Colour picture.", rich_help_panel=FRAME)]
Depth = Annotated[str | None, typer.Option(help="Depth picture.", rich_help_panel=FRAME)]
Intrinsics = Annotated[
    str | None, typer.Option(metavar="FILE|fx,fy,cx,cy", help="Camera of the depth picture.", rich_help_panel=FRAME)
]
Fov = Annotated[
    float | None, typer.Option(metavar="DEG", help="Vertical field of view, without intrinsics.", rich_help_panel=FRAME)
]
DepthScale = Annotated[
    float | None, typer.Option(metavar="N", help="Depth units per metre (1000: millimetres).", rich_help_panel=FRAME)
]
DepthKind = Annotated[
    str | None, typer.Option(metavar="KIND", help="z, ray, plane, inverse or disparity.", rich_help_panel=FRAME)
]
Baseline = Annotated[
    float | None, typer.Option(metavar="M", help="Metres between the cameras of a disparity.", rich_help_panel=FRAME)
]
Normals = Annotated[str, typer.Option(metavar="METHOD", help="How normals are estimated.", rich_help_panel=FRAME)]
MaxDepthStep = Annotated[
    str | None,
    typer.Option(metavar="M", help="Depth step that ends a surface: metres, or '3%'.", rich_help_panel=FRAME),
]
NoiseOption = Annotated[
    str | None,
    typer.Option("--noise", metavar="M|SENSOR", help="Noise of the depth: metres, or kinect.", rich_help_panel=FRAME),
]
Device = Annotated[int, typer.Option(metavar="N", help="Which GPU (Linux).")]
Lights = Annotated[
    list[str] | None,
    typer.Option(
        metavar="X,Y,Z",
        help="Point light, metres, world axes; repeatable. In place of a scene's own.",
        rich_help_panel=LIGHT,
    ),
]
Output = Annotated[Path, typer.Option("-o", "--output", help="The file to write.")]
Shading = Annotated[str, typer.Option(metavar="MODEL", help="none, flat, gouraud or phong.", rich_help_panel=LIGHT)]
Ambient = Annotated[float, typer.Option(help="Strength of the ambient light.", rich_help_panel=LIGHT)]
Diffuse = Annotated[float, typer.Option(help="Strength of the matt reflection.", rich_help_panel=LIGHT)]
Specular = Annotated[float, typer.Option(help="Strength of the highlight.", rich_help_panel=LIGHT)]
Shininess = Annotated[float, typer.Option(help="Exponent of the highlight.", rich_help_panel=LIGHT)]
Splat = Annotated[str, typer.Option(help="footprint or round.", rich_help_panel=VIEW)]
