#include "common/resolve.glsl"

// Divides the light of a picture out of its colours, so that another light does not shade them twice.

const float LEAST_GAIN = 0.5;
const float MOST_GAIN = 6.0;

// How brightly a normal is lit. light: unit direction towards it, and ambient light over the strength of the direction's.
float shading_at(vec3 normal, vec4 light) {
    return light.w + max(dot(normal, light.xyz), 0.0);
}

// What colours are multiplied by. white: the shading that leaves them as they are.
float shading_gain(float shading, float white) {
    return clamp(white / max(shading, 1e-6), LEAST_GAIN, MOST_GAIN);
}

// Linear light times a gain, but at most 1: all channels are multiplied by the same, so that the hue stays.
vec3 gained(vec3 linear, float gain) {
    float most = max(max(linear.r, linear.g), max(linear.b, 1e-6));
    return linear * min(gain, max(1.0 / most, 1.0));
}

// What is seen at a position between the pixels of a frame: the nearest of the four that has a surface.
Seen see_nearest(sampler2D surface_map, vec2 at) {
    Corners corners = corners_at(surface_map, at);
    vec4 far = vec4(
        distance(at, vec2(corners.low)), distance(at, vec2(corners.high.x, corners.low.y)),
        distance(at, vec2(corners.low.x, corners.high.y)), distance(at, vec2(corners.high))
    );
    far += 10.0 * vec4(equal(vec4(corners.a.w, corners.b.w, corners.c.w, corners.d.w), vec4(0.0)));
    bool right_above = far.y < far.x;
    bool right_below = far.w < far.z;
    bool below = (right_below ? far.w : far.z) < (right_above ? far.y : far.x);
    bvec2 side = bvec2(below ? right_below : right_above, below);
    return Seen(at, 0.0, corner_pixel(corners, side), corner_surface(corners, side), corners);
}

// What linear light seen there is multiplied by; 1 without a surface or a normal.
float gain_at(sampler2D surface_map, vec2 at, vec4 source, vec4 light, float white) {
    Seen seen = see_nearest(surface_map, at);
    if (seen.own.w == 0.0 || seen.own.xyz == vec3(0.0)) return 1.0;
    return shading_gain(shading_at(mix_normal(seen, seen_weights(seen, source)), light), white);
}
