#version 330 core
// Cells and their planes -> the surface of missing points; what is cleared stays so where no point is completed.
#include "common/completion_pixels.glsl"

uniform sampler2D near_planes;  // these three from completion_cells.frag
uniform sampler2D other_planes;
uniform sampler2D colors_map;
uniform sampler2D plane_map;    // from completion_settled.frag
uniform sampler2D surface_map;
uniform sampler2D color_map;
uniform sampler2D hidden_map;
uniform vec4 source;

out vec4 completed;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), size = textureSize(surface_map, 0);
    float share = texel_at(surface_map, pixel).w == 0.0 ? texel_at(plane_map, pixel / SIDE).w : 0.0;
    completed = vec4(0.0);
    for (int turn = 0; turn < once_if(share); ++turn) {
        vec4 color = guide_at(color_map, pixel, size);
        float hidden_below = HIDDEN == 1 ? hidden_below_at(hidden_map, pixel, size) : 0.0;
        completed = color.a > 0.0 ? complete_pixel(
            near_planes, other_planes, colors_map, plane_map, pixel, color.rgb, hidden_below, source
        ) : vec4(0.0);
    }
    if (completed.w == 0.0) discard;
}
