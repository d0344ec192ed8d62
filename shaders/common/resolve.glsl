#include "common/splat_corners.glsl"
#include "common/picture.glsl"

// What a pixel of the view shows of a frame, and the frame's values there. They are mixed from the four pixels around
// the position, but never across an edge.

const float FEW = 0.001;          // the smallest sum of weights that is enough for a mean
const float DEPTH_STEPS = 0.0002;  // share of 1/z below which a depth buffer tells no difference

struct Seen {
    vec2 at;              // position in the frame
    float inverse_depth;  // 1/z in the target view
    ivec2 pixel;          // whose splat is seen
    vec4 own;             // its surface; depth 0 if there is none
    Corners corners;      // around the position
};

// What a target pixel shows if it is known which splat is seen there. rim_depth: 1/z of a rim there; 0 if it is none.
Seen see_splat(
    sampler2D surface_map, ivec2 pixel, vec2 target_pixel, vec4 source, mat4 view, vec4 target, float rim_depth
) {
    vec2 centre = vec2(pixel);
    vec4 own = surface_at(surface_map, pixel);
    vec2 slope = inverse_depth_slope(own.xyz, pixel_ray(centre, source), own.w, source);
    vec2 at = source_position(carry_footprint(centre, own.w, own.xyz, source, view, target), centre, target_pixel);
    float w_at = inverse_depth_at(at, centre, 1.0 / own.w, slope);
    float inverse_depth = w_at / (mat3(view) * pixel_ray(at, source) + view[3].xyz * w_at).z;
    bool is_off = abs(rim_depth - inverse_depth) > DEPTH_STEPS * rim_depth;
    int rims = rim_depth > 0.0 && is_off ? 1 : 0;  // a loop that no pixel takes costs software drivers nothing
    for (int k = 0; k < rims; ++k) {
        inverse_depth = rim_depth;
        at = carry_back(target_pixel, rim_depth, target, view, source).xy;
    }
    Corners corners = corners_at(surface_map, at);
    for (int k = 0; k < rims; ++k) {
        float over = abs(texel_at(surface_map, clamp(ivec2(floor(at + 0.5)), corners.low, corners.high)).w);
        w_at = carry_back(target_pixel, rim_depth, target, view, source).z;
        if (over > 0.0 && over * w_at < 1.0) at = centre;  // hidden in its frame
    }
    return Seen(at, inverse_depth, pixel, own, corners);
}

// What a target pixel shows if only its 1/z is known, and whether it is hidden in its frame: that says where to look.
Seen look_up(
    sampler2D surface_map, float inverse_depth, bool hidden, vec2 target_pixel, vec4 source, mat4 view, vec4 target
) {
    vec3 back = carry_back(target_pixel, inverse_depth, target, view, source);
    Corners corners = corners_at(surface_map, back.xy);
    bvec2 side = seen_corner(corners, back.xy, back.z);
    ivec2 pixel = corner_pixel(corners, side);
    vec4 own = corner_surface(corners, side);
    float least = 1e30;
    int around = 2 * HIDDEN_PIXELS + 1, searches = hidden ? around * around : 0;
    ivec2 first = ivec2(floor(back.xy + 0.5)) - HIDDEN_PIXELS;
    for (int k = 0; k < searches; ++k) {  // the pixel whose plane goes on here
        ivec2 other = first + ivec2(k % around, k / around);
        vec4 surface = texel_or_zero(surface_map, other);
        vec2 off = back.xy - vec2(other);
        vec2 slope = inverse_depth_slope(surface.xyz, pixel_ray(vec2(other), source), -surface.w, source);
        float error = abs(-1.0 / surface.w + dot(slope, off) - back.z) + NEARBY * back.z * dot(off, off);
        bool is_better = surface.w < 0.0 && error < least;
        pixel = is_better ? other : pixel;
        own = is_better ? vec4(surface.xyz, -surface.w) : own;
        least = is_better ? error : least;
    }
    return Seen(least < 1e30 ? vec2(pixel) : back.xy, inverse_depth, pixel, own, corners);
}

vec4 seen_weights(Seen seen, vec4 source) {
    vec2 pixel = vec2(seen.pixel);
    vec2 slope = inverse_depth_slope(seen.own.xyz, pixel_ray(pixel, source), seen.own.w, source);
    return corner_weights(seen.corners, seen.at, pixel, 1.0 / seen.own.w, slope);
}

vec3 mix_normal(Seen seen, vec4 weight) {
    Corners corners = seen.corners;
    float total = weight.x + weight.y + weight.z + weight.w;
    vec3 mixed = weight.x * corners.a.xyz + weight.y * corners.b.xyz
        + weight.z * corners.c.xyz + weight.w * corners.d.xyz;
    return total > FEW ? normalize(mixed) : seen.own.xyz;
}

// light_map: linear light of each pixel of the frame
vec3 mix_light(Seen seen, vec4 weight, sampler2D light_map) {
    ivec2 low = seen.corners.low, high = seen.corners.high;
    float total = weight.x + weight.y + weight.z + weight.w;
    vec3 mixed = weight.x * texelFetch(light_map, low, 0).rgb
        + weight.y * texelFetch(light_map, ivec2(high.x, low.y), 0).rgb
        + weight.z * texelFetch(light_map, ivec2(low.x, high.y), 0).rgb
        + weight.w * texelFetch(light_map, high, 0).rgb;
    return total > FEW ? mixed / total : texelFetch(light_map, seen.pixel, 0).rgb;
}

// Where to read the colour: between pixels with neighbours on all sides; beside an edge at the pixel itself, so that
// the other side of the edge does not mix in.
vec2 color_position(Seen seen, vec4 weight) {
    return min(min(weight.x, weight.y), min(weight.z, weight.w)) > 0.0 ? seen.at : vec2(seen.pixel);
}

// The colour there of a picture with a pixel for each of the frame: that of picture_at, from the corners that are known.
vec3 mix_color(Seen seen, vec4 weight, sampler2D color_map) {
    bool is_between = min(min(weight.x, weight.y), min(weight.z, weight.w)) > 0.0;
    ivec2 low = is_between ? seen.corners.low : seen.pixel;
    ivec2 high = is_between ? seen.corners.high : seen.pixel;
    vec2 share = is_between ? seen.at - vec2(low) : vec2(0.0);
    return mix_picture(color_map, low, high, share);
}
