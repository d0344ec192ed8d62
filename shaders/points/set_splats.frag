#version 330 core
// As splats.frag, for one of several frames: notes the key of the splat, see common/parts.glsl. Depth is that of the
// splat's plane, and what is trusted or primary lies before all else.
#ifndef EXACT
#define EXACT 0  // 1: one of several frames without noise
#endif
#include "common/parts.glsl"

uniform bool is_round;
uniform sampler2D surface_map;
uniform sampler2D trust_map;
uniform float near;
uniform int first_id;
uniform float primary;  // share of the frame's splats
uniform float side;  // source pixels

flat in vec2 centre;
flat in vec4 to_source;
flat in vec2 bend;
flat in float reach;
flat in int id;
flat in float inverse_depth;
flat in vec2 tilt;
flat in vec4 to_target;

out int key;

void main() {
    vec2 offset = gl_FragCoord.xy - 0.5 - centre;
    if (!footprint_covers(to_source, bend, offset, reach, is_round)) discard;
    Footprint splat = Footprint(centre, to_target, inverse_depth, tilt, bend);
    ivec2 pixel = pixel_of(id - first_id, textureSize(surface_map, 0).x);
    bool stretched = is_stretched(footprint_extent(splat, reach, is_round), side);
    float trust = texelFetch(trust_map, pixel, 0).r;
    if (EXACT == 1 && is_spare(trust)) discard;
    int level = splat_level(trust, stretched, is_among(pixel, primary_share(primary, trust)));
    float here = footprint_inverse_depth(splat, to_source, offset);
    key = int(splat_key(here, level, false));
    gl_FragDepth = (float(4 - level) - clamp(near * here, 0.0, 1.0)) * 0.25;
}
