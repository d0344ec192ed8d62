#version 330 core
// A surface (unit normal, depth) -> the same without gaps that known pixels of one surface enclose.
#include "common/gaps.glsl"
#include "common/vote.glsl"

uniform sampler2D surface_map;
uniform sampler2D row_map;    // from gap_rows.frag
uniform sampler2D color_map;  // a gap that it cuts out stays
uniform int reach;
uniform vec4 source;

layout(location = 0) out vec4 normal;
layout(location = 1) out float depth;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 filled = fill_gap(surface_map, row_map, pixel, reach, source);
    if (is_cut_out(color_map, vec2(pixel), vec2(textureSize(surface_map, 0)))) filled = vec4(0.0);
    normal = vec4(filled.xyz, 0.0);
    depth = filled.w;
}
