#version 330 core
// The blended splats of a view -> the normal and depth of the surface on which they lie: the normals of their cells, and
// the plane through the depths round a pixel, which shows folds.
#include "common/camera.glsl"
#include "common/trained_splats.glsl"

uniform sampler2D normals_map;  // sums of splat.frag
uniform sampler2D seen_map;     // depth of one surface, and cover: depth.frag
uniform vec4 target;
uniform vec2 shares;  // of the cells' normals, and of the plane
uniform float unlit;  // length of a mean normal: shorter is what is not lit, whose own are 0

out vec4 fitted;  // normal, 0 of what is not lit; depth

const int REACH = 6;               // pixels
const int STEP = 1;
const float FIT_WIDTH = 3.6;       // pixels: deviation of the weights
const float MEAN_WIDTH = 3.0;
const float FIT_DEPTH = 4.0;       // widths of a pixel there: what lies deeper by more is another surface
const float MEAN_DEPTH = 2.8;
const float ACROSS = 0.02;         // of a pixel whose depth differs: where none is like it, as at rims, these count

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(seen_map, 0) - 1;
    vec2 own = texelFetch(seen_map, pixel, 0).rg;
    if (own.x == 0.0) discard;
    float inverse_depth = 1.0 / own.x;
    vec3 first = vec3(0.0), second = vec3(0.0), right = vec3(0.0), mean = vec3(0.0);
    for (int y = -REACH; y <= REACH; y += STEP) {
        for (int x = -REACH; x <= REACH; x += STEP) {
            ivec2 at = pixel + ivec2(x, y);
            if (any(lessThan(at, ivec2(0))) || any(greaterThan(at, last))) continue;
            vec2 beside = texelFetch(seen_map, at, 0).rg;
            if (beside.x == 0.0) continue;
            float here = 1.0 / beside.x;
            float off = (here / inverse_depth - 1.0) * mean_focal_length(target), away = float(x * x + y * y);
            float weight = beside.y * exp(-0.5 * (away / (FIT_WIDTH * FIT_WIDTH) + off * off / (FIT_DEPTH * FIT_DEPTH)));
            vec3 place = vec3(1.0, x, y);
            first += weight * place;
            second += weight * vec3(place.y, place.y, place.z) * vec3(place.y, place.z, place.z);
            right += weight * here / inverse_depth * place;
            float near = exp(-0.5 * away / (MEAN_WIDTH * MEAN_WIDTH)) * (ACROSS + exp(-0.5 * off * off / (MEAN_DEPTH * MEAN_DEPTH)));
            mean += near * texelFetch(normals_map, at, 0).xyz;
        }
    }
    vec3 cells = texelFetch(normals_map, pixel, 0).xyz / own.y;
    vec3 normal = vec3(0.0);
    if (length(cells) >= unlit) {
        vec2 ray = pixel_ray(vec2(pixel), target).xy;
        vec3 plane = fitted_normal(first, second, right, ray, target.xy);
        normal = normalize(shares.x * mean / max(length(mean), 1e-6) + shares.y * plane);
    }
    fitted = vec4(normal, own.x);
}
