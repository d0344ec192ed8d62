// Shared by the resolve shaders: their inputs, and what a pixel of the view shows.
#ifndef HIDDEN
#define HIDDEN 1  // 0: no surface goes on behind another in its frame
#endif
#ifndef FILLED
#define FILLED 0  // 1: pixels in which nothing is seen get 0: software drivers are faster where none is left out
#endif
#include "common/resolve.glsl"

uniform sampler2D surface_map;  // of the frame: unit normal, depth
uniform vec4 source;
uniform vec4 target;
uniform mat4 view;

bool is_seen = true;  // is there a point in the pixel?

// LOOK_UP: the compute rasteriser wrote 1/z of the nearest splat; otherwise the points wrote which source pixel is seen.
#if LOOK_UP
layout(std430, binding = 0) restrict readonly buffer Nearest { uint nearest[]; };  // bits of 1/z, 0: nothing
uniform ivec2 target_size;

Seen find_seen() {
    float inverse_depth = uintBitsToFloat(nearest[int(gl_FragCoord.y) * target_size.x + int(gl_FragCoord.x)]);
    is_seen = inverse_depth != 0.0;
    if (FILLED == 0 && !is_seen) discard;
    bool hidden = HIDDEN == 1 && (floatBitsToUint(inverse_depth) & 1u) == 1u;
    Seen seen = look_up(surface_map, inverse_depth, hidden, gl_FragCoord.xy - 0.5, source, view, target);
    is_seen = is_seen && seen.own.w != 0.0;
    if (FILLED == 0 && !is_seen) discard;
    return seen;
}
#else
uniform isampler2D source_ids;
uniform sampler2D window_depths;  // 1 - depth_scale/z
uniform float depth_scale;
uniform int first_id;         // of the first pixel; 0: nothing, below: a rim

Seen find_seen() {
    ivec2 size = textureSize(surface_map, 0);
    int id = texelFetch(source_ids, ivec2(gl_FragCoord.xy), 0).r;
    int index = abs(id) - first_id;
    float rim_depth = id < 0 ? (1.0 - texelFetch(window_depths, ivec2(gl_FragCoord.xy), 0).r) / depth_scale : 0.0;
    is_seen = index >= 0 && index < size.x * size.y;
    if (FILLED == 0 && !is_seen) discard;
    vec2 pixel = gl_FragCoord.xy - 0.5;
    return see_splat(surface_map, pixel_of(index, size.x), pixel, source, view, target, rim_depth);
}
#endif
