#version 330 core
// As splats.frag, for one of several frames: notes the key of the splat, see common/parts.glsl. Depth is that of the
// splat's plane, and what is trusted or primary lies before all else.
#include "common/parts.glsl"
#include "drawn.glsl"

uniform sampler2D trust_map;
uniform float near;
uniform bool is_primary;
uniform float side;  // source pixels

out int key;

void main() {
    float here = covering_inverse_depth();
    if (here == 0.0) discard;
    Footprint splat = Footprint(centre, to_target, inverse_depth, tilt, bend);
    float trust = texelFetch(trust_map, pixel_of(id - first_id, textureSize(surface_map, 0).x), 0).r;
    int level = splat_level(trust, is_stretched(footprint_extent(splat, reach, is_round), side), is_primary);
    key = int(splat_key(here, level));
    gl_FragDepth = (float(4 - level) - clamp(near * here, 0.0, 1.0)) * 0.25;
}
