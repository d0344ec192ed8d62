"""Tiny networks in .onnx files: a few operators each, with the inputs and outputs of known families."""

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

OPEN = (1, 3, "height", "width")
FLAT = (1, "height", "width")


def save_network(path, nodes, outputs, shape=OPEN, held=(), more=(), name="image", kind=TensorProto.FLOAT, **metadata):
    """Write a network; `outputs` are names or (name, shape), `held` arrays by name, `more` further inputs."""
    inputs = [helper.make_tensor_value_info(name, kind, shape), *more]
    named = [(one, None) if isinstance(one, str) else one for one in outputs]
    given = [helper.make_tensor_value_info(one, TensorProto.FLOAT, sides) for one, sides in named]
    arrays = [numpy_helper.from_array(np.asarray(array), key) for key, array in dict(held).items()]
    graph = helper.make_graph(list(nodes), "tiny", inputs, given, arrays)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)])
    model.ir_version = 8
    helper.set_model_props(model, {key: str(value) for key, value in metadata.items()})
    path.parent.mkdir(parents=True, exist_ok=True)
    onnx.save(model, path)
    return path


def node(kind, inputs, output, **attributes):
    return helper.make_node(kind, inputs.split(), [output], **attributes)


MEAN = node("ReduceMean", "image", "depth", axes=[1], keepdims=0)


def save_mean(path, shape=OPEN, **metadata):
    """Write a network that gives the mean of its three channels, called depth."""
    return save_network(path, [MEAN], [("depth", (shape[0], *shape[2:]))], shape, **metadata)


def save_linear(path, factor, offset, output="depth", more_nodes=(), more_outputs=(), held=(), **options):
    """Write a network that gives factor * mean + offset, under a name."""
    nodes = [
        node("ReduceMean", "image", "mean", axes=[1], keepdims=0),
        node("Mul", "mean factor", "scaled"),
        node("Add", "scaled offset", output),
        *more_nodes,
    ]
    held = {"factor": np.float32(factor), "offset": np.float32(offset), **dict(held)}
    return save_network(path, nodes, [(output, FLAT), *more_outputs], held=held, **options)


def save_constant(path, outputs, shape=OPEN, **options):
    """Write a network that gives arrays, whatever it is shown."""
    nodes = [node("Identity", f"held_{name}", name) for name in outputs]
    nodes.append(node("Shape", "image", "unused"))
    held = {f"held_{name}": np.asarray(array, np.float32) for name, array in outputs.items()}
    return save_network(path, nodes, list(outputs), shape, held, **options)
