#include "common/camera.glsl"
#include "common/depth_average.glsl"

// Depth and normals that rest on several frames of a stream: a Kalman filter at each pixel (Kalman 1960). How far the
// surface has moved since, its process noise, shows in how new and old depth differ around the pixel.

const float SAME_STEP = 0.02;      // by which old neighbours may differ from the new depth, relative to w, beyond noise
const float WIDEST_CHANGE = 4.0;   // standard deviations: larger changes count as this large around a pixel
const float CALM_POWER = 3.0;      // power of changes around a pixel that noise alone rarely exceeds; its mean is 1
const float CALM_OWN = 9.0;        // the same for the pixel's own change
const float DOUBT = 2.0;           // each unit of power beyond adds so much to the old variance, times that of a change
const float MOST_SHARE = 0.97;     // of the new frame: above, nothing of the old is left
const float LEAST_SHARE = 0.0625;  // of the new frame: what is remembered rests on about 1 / LEAST_SHARE frames

// Texel at pixel + offset, 0 outside the picture; read as in `depth_at`.
vec4 history_at(sampler2D picture, ivec2 pixel, ivec2 offset) {
    vec2 at = (vec2(pixel + offset) + 0.5) * (1.0 / vec2(textureSize(picture, 0)));
    vec4 texel = textureLod(picture, at, 0.0);
    return at == clamp(at, vec2(0.0), vec2(1.0)) ? texel : vec4(0.0);
}

// Noise over depth of a new depth. rounding: its step at depth 1, and the power of z with which step / z grows. All of
// a plateau may be rounded up in one frame and down in the next, so averaging over neighbours does not reduce that.
float fresh_noise(vec2 here, vec2 rounding) {
    float rounded = here.x > 0.0 ? rounding.x * pow(here.x, rounding.y) : 0.0;
    return sqrt(here.y * here.y + rounded * rounded / 12.0 + NEGLIGIBLE * NEGLIGIBLE);
}

// What is remembered at a pixel: by how much its w differs from the new one, relative to that (x), and its noise (y);
// 0 and 0 of nothing.
vec2 old_step(sampler2D history_map, ivec2 pixel, float here) {
    vec4 old = history_at(history_map, pixel, ivec2(0));
    return here > 0.0 && old.r > 0.0 ? vec2(relative_step(here, old.r), old.b) : vec2(0.0);
}

// Where a new point lies for the old camera: position in its picture, and depth. view takes new axes to old axes.
vec3 carry_to_old(ivec2 pixel, float here, vec4 intrinsics, mat4 view) {
    vec3 there = mat3(view) * (here * pixel_ray(vec2(pixel), intrinsics)) + view[3].xyz;
    return vec3(project(there, intrinsics), there.z);
}

// old_step for a camera that has moved; there: from carry_to_old. w is linear on planes, so its bilinear mean over
// four pixels is exact there; all of them must lie on the surface.
vec2 carried_step(sampler2D history_map, vec3 there) {
    if (!(there.z > 0.0)) return vec2(0.0);
    ivec2 corner = ivec2(floor(there.xy));
    vec2 share = there.xy - vec2(corner), mean = vec2(0.0);
    bool same = true;
    for (int k = 0; k < 4; ++k) {
        ivec2 side = ivec2(k % 2, k / 2);
        vec4 old = history_at(history_map, corner, side);
        float step = relative_step(there.z, old.r);
        vec2 weight = mix(1.0 - share, share, vec2(side));
        same = same && old.r > 0.0 && abs(step) < SAME_STEP + WIDEST_CHANGE * old.b;
        mean += weight.x * weight.y * vec2(step, old.b);
    }
    return same ? mean : vec2(0.0);
}

// The normal that is remembered there, not of unit length, in the old camera's axes.
vec3 carried_normal(sampler2D normal_map, vec3 there) {
    ivec2 corner = ivec2(floor(there.xy));
    vec2 share = there.xy - vec2(corner);
    vec3 a = history_at(normal_map, corner, ivec2(0)).xyz, b = history_at(normal_map, corner, ivec2(1, 0)).xyz;
    vec3 c = history_at(normal_map, corner, ivec2(0, 1)).xyz, d = history_at(normal_map, corner, ivec2(1)).xyz;
    return mix(mix(a, b, share.x), mix(c, d, share.x), share.y);
}

// x: the old step in standard deviations of what noise alone makes; y: noise of the old depth.
vec2 change_of(vec2 step, float noise) {
    return vec2(step.x / sqrt(step.y * step.y + noise * noise), step.y);
}

// Power of the changes of 25 pixels `stride` pixels apart: of their mean and their two slopes; noise alone gives 1.
float change_power(sampler2D change_map, ivec2 pixel, int stride) {
    float known = 0.0, sum = 0.0, along_u = 0.0, along_v = 0.0, uu = 0.0, vv = 0.0;
    for (int k = 0; k < 25; ++k) {
        vec2 offset = vec2(k % 5 - 2, k / 5 - 2);
        vec2 change = history_at(change_map, pixel, ivec2(k % 5 - 2, k / 5 - 2) * stride).rg;
        float weight = change.y > 0.0 ? 1.0 : 0.0;
        float size = weight * clamp(change.x, -WIDEST_CHANGE, WIDEST_CHANGE);
        known += weight;
        sum += size;
        along_u += offset.x * size;
        along_v += offset.y * size;
        uu += weight * offset.x * offset.x;
        vv += weight * offset.y * offset.y;
    }
    float tilt = along_u * along_u / max(uu, 1.0) + along_v * along_v / max(vv, 1.0);
    return (sum * sum / max(known, 1.0) + tilt) / 3.0;
}

// Share of the new frame in what is remembered from now on (x), and the noise of that (y).
vec2 fresh_share(float noise, vec2 change, float power) {
    if (change.y == 0.0) return vec2(1.0, noise);
    float fresh = noise * noise, both = fresh + change.y * change.y;
    float doubt = DOUBT * (max(power - CALM_POWER, 0.0) + max(change.x * change.x - CALM_OWN, 0.0));
    float old = change.y * change.y + doubt * both;
    float share = max(old / (old + fresh), LEAST_SHARE);
    if (share > MOST_SHARE) share = 1.0;
    return vec2(share, min(sqrt((1.0 - share) * (1.0 - share) * old + share * share * fresh), noise));
}

// The depth that is remembered from now on.
float mixed_depth(float here, float noise, vec2 change, float share) {
    float step = change.x * sqrt(change.y * change.y + noise * noise);
    return here / (1.0 + (1.0 - share) * step);
}

// The normal that is remembered from now on: towards the camera, as the new one is.
vec3 mixed_normal(vec3 fresh, vec3 old, float share, vec3 ray) {
    vec3 sum = mix(old, fresh, share);
    return share < 1.0 && dot(sum, ray) < 0.0 ? sum / sqrt(dot(sum, sum)) : fresh;
}
