#include "common/resolve.glsl"

// Takes the highlights of a picture out of its colours: S = max(r . l, 0)^n (Phong 1975) times their strength.

const float MOST_HIGHLIGHT = 0.9;  // share of the light that may be a highlight
const float FAINT = 0.001;         // part of a highlight that is worth no further look
const float SAME_DEPTH = 0.03;     // share of the depth between samples of one surface
const float SMOOTH_NEAR = 0.9;     // cosine between normals that are averaged
const int SMOOTH_STEP = 2;         // pixels between them

// How strong highlights are at a position in a picture of some size and at a depth. strength_map: small, strength and
// depth.
float strength_at(sampler2D strength_map, vec2 at, vec2 size, float depth) {
    Corners corners = corners_at(strength_map, rescale_position(at, size, vec2(textureSize(strength_map, 0))));
    vec2 share = rescale_position(at, size, vec2(textureSize(strength_map, 0))) - vec2(corners.low);
    share = clamp(share, 0.0, 1.0);
    vec4 weight = vec4(
        (1.0 - share.x) * (1.0 - share.y), share.x * (1.0 - share.y), (1.0 - share.x) * share.y, share.x * share.y
    );
    vec4 away = abs(vec4(corners.a.y, corners.b.y, corners.c.y, corners.d.y) - depth);
    weight *= vec4(lessThan(away, vec4(SAME_DEPTH * depth)));
    float total = weight.x + weight.y + weight.z + weight.w;
    float sum = dot(weight, vec4(corners.a.x, corners.b.x, corners.c.x, corners.d.x));
    return total > FEW ? sum / total : 0.0;
}

// S of a unit normal at a point, source axes. light: l and q, the light comes from the direction of l - q * point.
float highlight_of(vec3 normal, vec3 point, vec4 light, float exponent) {
    vec3 eye = -normalize(point);
    vec3 l = normalize(light.xyz - light.w * point);
    vec3 r = 2.0 * dot(normal, eye) * normal - eye;
    return dot(normal, l) > 0.0 ? pow(max(dot(r, l), 1e-6), exponent) : 0.0;
}

// The mean normal around a position, weighed by a Gaussian of 2 pixels, on the side of edges where `own` is.
vec3 smooth_normal(sampler2D surface_map, vec2 at, vec3 own) {
    ivec2 last = textureSize(surface_map, 0) - 1;
    ivec2 middle = ivec2(floor(at + 0.5));
    vec3 sum = vec3(0.0);
    for (int k = 0; k < 25; ++k) {
        ivec2 pixel = clamp(middle + SMOOTH_STEP * (ivec2(k % 5, k / 5) - 2), ivec2(0), last);
        vec2 off = vec2(pixel) - at;
        vec3 normal = texel_at(surface_map, pixel).xyz;
        if (dot(normal, own) > SMOOTH_NEAR) sum += exp(-0.125 * dot(off, off)) * normal;
    }
    return normalize(sum);
}

// The linear light of the highlight at a position in a frame.
float highlight_at(
    sampler2D surface_map, sampler2D strength_map, vec2 at, vec4 source, vec4 light, float exponent
) {
    vec4 own = surface_at(surface_map, clamp(ivec2(floor(at + 0.5)), ivec2(0), textureSize(surface_map, 0) - 1));
    if (own.w == 0.0 || own.xyz == vec3(0.0)) return 0.0;
    vec3 point = pixel_ray(at, source) * own.w;
    int lit = highlight_of(own.xyz, point, light, 0.7 * exponent) > FAINT ? 1 : 0;  // noisy normals may hide some
    float found = 0.0;
    for (int k = 0; k < lit; ++k) {  // a loop that no pixel takes costs software drivers nothing
        vec3 normal = smooth_normal(surface_map, at, own.xyz);
        float strength = strength_at(strength_map, at, vec2(textureSize(surface_map, 0)), own.w);
        found = strength * highlight_of(normal, point, light, exponent);
    }
    return found;
}

vec3 without_highlight(vec3 linear, float highlight) {
    return linear - min(vec3(highlight), MOST_HIGHLIGHT * linear);
}
