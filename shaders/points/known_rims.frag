#version 330 core
// Estimates the rims on a list, for rims.vert with KNOWN.
#include "common/rims.glsl"
#include "points/kept_rims.glsl"

uniform sampler2D surface_map;  // unit normal, depth
uniform isampler2D numbers;     // of the rim pixels
uniform vec4 source;

layout(location = 0) out vec4 head;
layout(location = 1) out vec4 outline;
layout(location = 2) out vec4 slopes;
layout(location = 3) out vec4 fold;

void main() {
    ivec2 pixel = pixel_of(texelFetch(numbers, ivec2(gl_FragCoord.xy), 0).r, textureSize(surface_map, 0).x);
    mat4 kept = packed_rim(pixel, estimate_rim(surface_map, pixel, source));
    head = kept[0];
    outline = kept[1];
    slopes = kept[2];
    fold = kept[3];
}
