#include "common/texels.glsl"

// Reading depth pictures in terms of w = 1/z, in which every plane is linear.

const float FAR_NEARER = 1e-6;  // a neighbour nearer than this share of the pixel's depth counts as missing

// (w_there - w_here) / w_here, computed from the depths: equal digits cancel exactly, and no unit remains.
// A missing neighbour becomes a step of a million, which counts as a jump everywhere.
float relative_step(float here, float there) {
    float other = max(there, here * FAR_NEARER);
    return (here - other) / other;
}

// Unit normal towards the camera of the plane whose w changes by slope * w per pixel in u and v.
// ray = (pixel - principal point) / focal lengths. A plane n.P = c has w = n.ray / c, linear in u and v.
vec3 normal_of_slope(vec2 slope, vec2 ray, vec4 intrinsics) {
    vec2 tilt = intrinsics.xy * slope;
    vec3 n = vec3(-tilt.x, -tilt.y, ray.x * tilt.x + ray.y * tilt.y - 1.0);
    return n / sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
}

// Slope of w of the surface that faces the viewer along this ray: the answer if no neighbour is known.
vec2 facing_slope(vec2 ray, vec4 intrinsics) {
    return ray / (1.0 + ray.x * ray.x + ray.y * ray.y) / intrinsics.xy;
}
