"""A network of the transformers family, tiny and random, gives depth as its pipelines do. Where torch is installed.

In a process of its own, whose first imports are those of torch: in one that has drawn, they end some drivers.
"""

import subprocess
import sys
from importlib.util import find_spec

import pytest

pytestmark = [
    pytest.mark.system,
    pytest.mark.gl,
    pytest.mark.skipif(not (find_spec("torch") and find_spec("transformers")), reason="needs torch and transformers"),
]

PROGRAM = """
import numpy as np
import torch
import transformers
from PIL import Image

torch.manual_seed(0)
stages = ["stage1", "stage2", "stage3", "stage4"]
backbone = transformers.Dinov2Config(
    hidden_size=16, num_hidden_layers=4, num_attention_heads=2, intermediate_size=32, image_size=56, patch_size=14,
    out_features=stages, apply_layernorm=True, reshape_hidden_states=False,
)
config = transformers.DepthAnythingConfig(
    backbone_config=backbone, reassemble_hidden_size=16, neck_hidden_sizes=[8] * 4, fusion_hidden_size=8,
    head_hidden_size=8, patch_size=14,
)
network = transformers.DepthAnythingForDepthEstimation(config).eval()
sides = {"height": 56, "width": 56}
processor = transformers.DPTImageProcessor(size=sides, ensure_multiple_of=14, keep_aspect_ratio=True)
pipe = transformers.pipeline("depth-estimation", model=network, image_processor=processor)

import pointshade_gl as ps

rgb = np.random.default_rng(0).integers(0, 255, (48, 64, 3), np.uint8)
frame = ps.load_frame(
    color=rgb, depth=lambda rgb: pipe(Image.fromarray(rgb))["predicted_depth"], depth_kind="inverse"
)
assert frame.depth.shape == (48, 64) and (frame.depth.min(), frame.depth.max()) == (1, 10)
assert ps.render(frame).shape == (48, 64, 4)
print("drawn")
"""


def test_a_pipeline_is_a_function_of_the_photograph():
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and done.stdout.strip().endswith("drawn"), done.stderr
