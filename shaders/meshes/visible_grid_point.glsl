// Shared by the fragment shaders of a mesh: what a pixel of the view shows.
#include "common/grid.glsl"

uniform sampler2D surface_map;   // of the frame: unit normal, depth
uniform sampler2D triangle_map;  // from grid_triangles.frag
uniform vec4 source;
uniform vec4 target;
uniform mat4 view;
uniform float near;              // source units
#if LOOK_UP
layout(std430, binding = 0) restrict readonly buffer Nearest { uint nearest[]; };  // bits of 1/z, 0: nothing
uniform ivec2 target_size;
#else
uniform sampler2D window_depths;  // 1 - near/z
#endif

// Discards the pixel if nothing is seen.
GridSeen find_seen() {
#if LOOK_UP
    float inverse_depth = uintBitsToFloat(nearest[int(gl_FragCoord.y) * target_size.x + int(gl_FragCoord.x)]);
#else
    float inverse_depth = (1.0 - texelFetch(window_depths, ivec2(gl_FragCoord.xy), 0).r) / near;
#endif
    if (inverse_depth == 0.0) discard;
    return look_up_grid(surface_map, triangle_map, inverse_depth, gl_FragCoord.xy - 0.5, source, view, target);
}
