#version 330 core
// A surface (unit normal, depth) -> the same without gaps that known pixels of one surface enclose.
#include "common/gap_filling.glsl"
#include "common/upsample_vote.glsl"

uniform sampler2D surface_map;
uniform sampler2D row_map;    // from gap_rows.frag
uniform sampler2D color_map;  // a gap that it cuts out stays
uniform int reach;
uniform vec4 source;

layout(location = 0) out vec4 normal;  // w: 1 where it was cut out
layout(location = 1) out float depth;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 filled = fill_gap(surface_map, row_map, pixel, reach, source);
    bool cut_out = is_cut_out(color_map, vec2(pixel), vec2(textureSize(surface_map, 0)));
    normal = cut_out ? vec4(0.0, 0.0, 0.0, 1.0) : vec4(filled.xyz, 0.0);
    depth = cut_out ? 0.0 : filled.w;
}
