#version 330 core
#ifndef LIT
#define LIT 0  // 1: the rim has its colour already, and is drawn with it
#endif
#ifndef SET
#define SET 0  // 1: one of several frames: notes the key of the rim, as set_splats.frag does of a splat
#endif
#ifndef EXACT
#define EXACT 0  // 1: one of several frames without noise
#endif
// Keeps the pixels whose rays meet the rim, and notes which source pixel they show.
#include "common/parts.glsl"
#include "common/rim_splat.glsl"

uniform sampler2D surface_map;
uniform vec4 source;
uniform vec4 target;
uniform mat4 view;
uniform int first_id;
uniform float near;
#if SET
uniform sampler2D trust_map;
uniform sampler2D cuts_map;  // as in rims.comp
uniform float primary;  // share of its splats that hide those of others
#endif

flat in int id;
flat in float inverse_depth;
flat in vec4 rim;
flat in vec2 slope;
flat in vec4 hidden;
flat in mat4x3 folds;
flat in float stretched;

#if LIT
flat in vec3 lit;  // sRGB

out vec4 color;
#else
out int source_id;  // negative: its depth is exact; of several frames, the key
#endif

void main() {
    ivec2 pixel = pixel_of(id - first_id, textureSize(surface_map, 0).x);
    vec4 own = surface_at(surface_map, pixel);
    Rim found = Rim(rim.xy, rim.z, rim.w, slope, hidden, folds);
    vec2 q = gl_FragCoord.xy - 0.5;
    vec3 met = meet_rim(found, vec2(pixel), own, inverse_depth, q, source, view, target);
    float here = met.x;
    if (here == 0.0) discard;
#if LIT
    color = vec4(lit, 1.0);
    gl_FragDepth = 1.0 - near * here;
#elif SET
    float trust = texelFetch(trust_map, pixel, 0).r;
    if (EXACT == 1 && is_spare(trust)) discard;
    int level = splat_level(trust, stretched > 0.5, is_among(pixel, primary_share(primary, trust)));
    bool goes_on = is_hidden(found, met.yz), is_cut = is_cut_off(texelFetch(cuts_map, pixel, 0), met.yz);
    is_cut = is_cut && (EXACT == 1 || found.drop == 0.0);
    if (EXACT == 1 && (goes_on || is_cut || lies_deep(q, here, own.w, source, view, target))) discard;
    if (goes_on || is_cut) level &= 1;
    source_id = int(splat_key(here, level, goes_on));
    gl_FragDepth = (float(4 - level) - clamp(near * here, 0.0, 1.0)) * 0.25;
#else
    source_id = -id;
    gl_FragDepth = 1.0 - near * here;
#endif
}
