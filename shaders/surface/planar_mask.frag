#version 330 core
// Which samples of a surface need no vote: all around them lies on their plane.
#include "common/upsample_vote.glsl"

uniform sampler2D surface_map;
uniform vec4 source;

out float calm;

void main() {
    calm = is_calm(surface_map, ivec2(gl_FragCoord.xy), source);
}
