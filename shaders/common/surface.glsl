#include "common/splat.glsl"

// Looking a target pixel up in its frame, once it is known which source pixel covers it.

const float SAME_SURFACE = 0.02;  // a neighbour further off the tangent plane than this share of 1/z is another surface

// Position in the source picture that a target pixel shows; inside the splat by construction.
vec2 source_position(Footprint splat, vec2 pixel, vec2 target_pixel) {
    vec4 to_source = invert_footprint(splat.to_target);
    vec2 offset = target_pixel - splat.centre;
    return pixel + to_source.xy * offset.x + to_source.zw * offset.y;
}

// The point of the tangent plane at a position in the source picture; w and slope are the plane's 1/z at pixel.
vec3 point_on_plane(vec2 at, vec2 pixel, float w, vec2 slope, vec4 source) {
    float w_at = max(w + dot(slope, at - pixel), 0.01 * w);  // never behind the camera
    return pixel_ray(at, source) / w_at;
}

// Weight of the neighbour with depth z at a corner round `at`: bilinear, but 0 where the neighbour is missing or on
// another surface, so that nothing blends across an edge.
float neighbour_weight(float z, vec2 corner, vec2 at, vec2 pixel, float w, vec2 slope) {
    if (z == 0.0) return 0.0;
    float expected = w + dot(slope, corner - pixel);
    if (abs(1.0 / z - expected) > SAME_SURFACE * w) return 0.0;
    vec2 closeness = max(1.0 - abs(at - corner), 0.0);
    return closeness.x * closeness.y;
}
