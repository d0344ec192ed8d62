"""What a custom node needs of ComfyUI, as its V3 interface is published (comfy_api.latest, folder_paths).

Names, parameters and what they check are ComfyUI's; what they do is as little as the tests of examples/comfyui need.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from enum import Enum
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from PIL import Image as Picture


class FolderType(str, Enum):
    input = "input"
    output = "output"
    temp = "temp"


class Input:
    io_type = ""

    def __init__(self, id: str, display_name: str | None = None, optional: bool = False, tooltip: str | None = None):
        self.id, self.optional, self.tooltip = id, optional, tooltip


class Output:
    io_type = ""

    def __init__(self, id: str | None = None, display_name: str | None = None, tooltip: str | None = None):
        self.id, self.display_name = id, display_name


def kind(name: str, *of_input: str) -> type:
    """A type with its Input and Output; inputs take these parameters besides those of all."""

    class Own(Input):
        io_type = name

        def __init__(self, id: str, **given: Any):
            own = {key: given.pop(key) for key in of_input if key in given}
            super().__init__(id, **given)
            self.__dict__.update(own)

    class OwnOutput(Output):
        io_type = name

    return type(name, (), {"io_type": name, "Input": Own, "Output": OwnOutput})


class MultiType:
    class Input(Input):
        def __init__(self, id: str, types: list[type], **given: Any):
            super().__init__(id, **given)
            self.io_type = ",".join(one.io_type for one in types)


class Schema:
    def __init__(
        self,
        node_id: str,
        display_name: str | None = None,
        category: str = "sd",
        inputs: list[Input] | None = None,
        outputs: list[Output] | None = None,
        description: str = "",
        is_output_node: bool = False,
    ):
        self.node_id, self.display_name, self.category, self.is_output_node = (
            node_id,
            display_name,
            category,
            is_output_node,
        )
        self.inputs, self.outputs, self.description = inputs or [], outputs or [], description
        for names in ([one.id for one in self.inputs], [one.id for one in self.outputs if one.id]):
            assert len(set(names)) == len(names), f"ids must be unique: {names}"
        both = {one.id for one in self.inputs} & {one.id for one in self.outputs}
        assert not both, f"ids of inputs and outputs must differ: {both}"


class ComfyNode(ABC):
    @classmethod
    @abstractmethod
    def define_schema(cls) -> Schema: ...

    @classmethod
    @abstractmethod
    def execute(cls, **inputs: Any) -> NodeOutput: ...


class NodeOutput:
    def __init__(self, *args: Any, ui: Any = None):
        self.args, self.ui = args, ui


class ComfyExtension(ABC):
    @abstractmethod
    async def get_node_list(self) -> list[type[ComfyNode]]: ...


class SavedResult(dict):
    def __init__(self, filename: str, subfolder: str, type: FolderType):
        super().__init__(filename=filename, subfolder=subfolder, type=type.value)


def module(name: str, **contents: Any) -> ModuleType:
    made = ModuleType(name)
    made.__dict__.update(contents)
    return made


def modules(temp: Path) -> dict[str, ModuleType]:
    """The modules by their names, for sys.modules; pictures for previews go to the folder."""

    class PreviewImage:
        def __init__(self, image: Any, animated: bool = False, cls: type[ComfyNode] | None = None):
            temp.mkdir(exist_ok=True)
            self.values = []
            for number, one in enumerate(image):
                name = f"preview_{number}.png"
                Picture.fromarray((one.numpy() * 255).clip(0, 255).astype(np.uint8)).save(temp / name)
                self.values.append(SavedResult(name, "", FolderType.temp))

        def as_dict(self) -> dict[str, Any]:
            return {"images": self.values, "animated": (False,)}

    widget = ("default",)
    io = module(
        "comfy_api.latest.io",
        Image=kind("IMAGE"),
        Mask=kind("MASK"),
        Boolean=kind("BOOLEAN", *widget),
        Float=kind("FLOAT", *widget, "min", "max", "step"),
        Combo=kind("COMBO", *widget, "options"),
        Custom=kind,
        **{one.__name__: one for one in (MultiType, Schema, ComfyNode, NodeOutput, FolderType)},
    )
    ui = module("comfy_api.latest.ui", PreviewImage=PreviewImage, SavedResult=SavedResult)
    latest = module("comfy_api.latest", io=io, ui=ui, ComfyExtension=ComfyExtension)
    return {
        "comfy_api": module("comfy_api", latest=latest),
        "comfy_api.latest": latest,
        "folder_paths": module("folder_paths", get_temp_directory=lambda: str(temp)),
    }
