#version 330 core
#ifndef SHOW
#define SHOW 0    // 0: normals, 1: depth, 2: certainty of the normals
#endif
#ifndef LINEAR
#define LINEAR 0  // 1: the pixels are linear, to be averaged with other samples
#endif
// A picture of surfaces whose colours are no light: normals as normal maps have them, or numbers along a colour map.
#include "common/color.glsl"
#include "common/texels.glsl"
#include "common/toksvig.glsl"

uniform sampler2D surface_map;  // normal as long as it is certain (0: there is none), depth (0: nothing)
uniform vec2 range;             // of -1/z or degrees, from blue to red
uniform float upwards;          // of the second axis of the surfaces in the picture: -1 where it points down

out vec4 color;

const vec3 NO_NORMAL = vec3(0.25);
const float BLUE = 0.1;  // where the colours begin: before it turbo is nearly black, as holes are

// Turbo (A. Mikhailov 2019), his polynomial, for 0 to 1.
vec3 turbo(float x) {
    vec4 low = vec4(1.0, x, x * x, x * x * x);
    vec2 high = low.zw * low.z;
    return clamp(vec3(
        dot(low, vec4(0.13572138, 4.61539260, -42.66032258, 132.13108234)) + dot(high, vec2(-152.94239396, 59.28637943)),
        dot(low, vec4(0.09140261, 2.19418839, 4.84296658, -14.18503333)) + dot(high, vec2(4.27729857, 2.82956604)),
        dot(low, vec4(0.10667330, 12.64194608, -60.58204836, 110.36276771)) + dot(high, vec2(-89.90310912, 27.34824973))
    ), 0.0, 1.0);
}

// Degrees that a normal is expected to be off: the other way round of normal_certainty.
float expected_error(float certainty) {
    return degrees(sqrt(max(1.0 / max(certainty, 1e-3) - 1.0, 0.0) / WANDERING));
}

void main() {
    vec4 surface = texel_at(surface_map, ivec2(gl_FragCoord.xy));
    if (surface.w == 0.0) discard;
    float certainty = length(surface.xyz);
    float number = SHOW == 1 ? -1.0 / abs(surface.w) : expected_error(min(certainty, 1.0));
    float share = clamp((number - range.x) / max(range.y - range.x, 1e-6 * abs(range.x)), 0.0, 1.0);
    vec3 shown = turbo(mix(BLUE, 1.0, share));
    if (SHOW == 0) {
        vec3 normal = surface.xyz / max(certainty, 1e-6) * vec3(1.0, upwards, -1.0);
        shown = certainty > 0.0 ? 0.5 * normal + 0.5 : NO_NORMAL;
    }
    color = vec4(LINEAR == 1 ? srgb_to_linear(shown) : shown, 1.0);
}
