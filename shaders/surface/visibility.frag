#version 330 core
// What mean_hidden.frag found -> the visibility of each point of a frame.
#include "common/surroundings.glsl"
#include "common/visibility.glsl"

uniform sampler2D surface_map;
uniform sampler2D mean_map;
uniform vec4 intrinsics;
uniform int stride;

out vec4 texel;

void main() {
    texel = pack_visibility(visibility_at(mean_map, surface_map, ivec2(gl_FragCoord.xy), stride, intrinsics));
}
