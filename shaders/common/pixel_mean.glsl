#include "common/color.glsl"
#include "common/depth_lookup.glsl"
#include "common/picture.glsl"

// What all samples of a picture see in a pixel together, where only the colour of a surface changes within the pixel.

const float LEAST_CHANGE = 1.0 / 512.0;  // half a step of 8 bits: what changes less is not seen
const float GROWN = 1.001;               // source pixels a pixel of the view may be wide; else small things lie between

// Where sample k lies in its pixel, from -0.5 to 0.5: scene/sample_pattern.py says why.
vec2 sample_offset(int k) {
    float side = (k & 1) == 1 ? 1.0 : -1.0;
    return side * (fract(0.5 + float((k + 1) / 2) * vec2(0.75487767, 0.56984029)) - 0.5);
}

// How far the source position goes with a pixel of the view, across and down, for a viewer where the frame's camera was.
mat2 source_step(vec2 target_pixel, vec4 target, mat4 view, vec4 source) {
    vec2 right = carry_back(target_pixel + vec2(0.5, 0.0), 0.0, target, view, source).xy;
    vec2 left = carry_back(target_pixel - vec2(0.5, 0.0), 0.0, target, view, source).xy;
    vec2 below = carry_back(target_pixel + vec2(0.0, 0.5), 0.0, target, view, source).xy;
    vec2 above = carry_back(target_pixel - vec2(0.0, 0.5), 0.0, target, view, source).xy;
    return mat2(right - left, below - above);
}

// Are no source pixels so small in the view that they may lie between its pixels?
bool shows_all(mat2 wide) {
    return max(length(wide[0]), length(wide[1])) <= GROWN;
}

// The mean linear colour of a pixel's samples. at: of its middle in the source picture, which has this size
vec3 mean_color(sampler2D picture, vec2 at, mat2 wide, vec2 size, int samples) {
    vec3 sum = vec3(0.0);
    for (int k = 0; k < samples; ++k) sum += srgb_to_linear(picture_at(picture, at + wide * sample_offset(k), size));
    return sum / float(samples);
}

// The same where a pixel of the view is at most one of the picture, with upright sides: nine texels are all that it sees.
vec3 mean_of_nine(sampler2D picture, vec2 at, vec2 wide, int samples) {
    ivec2 first = ivec2(floor(at - 0.5)), last = textureSize(picture, 0) - 1;
    ivec2 a = clamp(first, ivec2(0), last), b = clamp(first + 1, ivec2(0), last), c = clamp(first + 2, ivec2(0), last);
    mat3 top = mat3(
        texelFetch(picture, a, 0).rgb, texelFetch(picture, ivec2(b.x, a.y), 0).rgb, texelFetch(picture, ivec2(c.x, a.y), 0).rgb
    );
    mat3 middle = mat3(
        texelFetch(picture, ivec2(a.x, b.y), 0).rgb, texelFetch(picture, b, 0).rgb, texelFetch(picture, ivec2(c.x, b.y), 0).rgb
    );
    mat3 bottom = mat3(
        texelFetch(picture, ivec2(a.x, c.y), 0).rgb, texelFetch(picture, ivec2(b.x, c.y), 0).rgb, texelFetch(picture, c, 0).rgb
    );
    vec3 places = vec3(0.0, 1.0, 2.0), sum = vec3(0.0);
    for (int k = 0; k < samples; ++k) {
        vec2 off = at - vec2(first) + wide * sample_offset(k);
        vec3 across = max(1.0 - abs(places - off.x), 0.0), down = max(1.0 - abs(places - off.y), 0.0);
        sum += srgb_to_linear(down.x * (top * across) + down.y * (middle * across) + down.z * (bottom * across));
    }
    return sum / float(samples);
}

// What of one change another one takes back.
vec3 opposed(vec3 one, vec3 other) {
    return mix(vec3(0.0), min(abs(one), abs(other)), lessThan(one * other, vec3(0.0)));
}

// By how much the mean of a value over a pixel may be off the value in its middle, at most, from three pixels in a row: an
// edge that crosses a pixel leaves in it half of its step.
vec3 mean_error(vec3 before, vec3 own, vec3 after) {
    return 0.5 * abs(before + after - 2.0 * own);
}

// The same from five, less where it is no edge: what bends at an edge is bent back in the next pixel. A fold is not, and leaves
// an eighth.
vec3 mean_error_of_five(vec3 far_before, vec3 before, vec3 own, vec3 after, vec3 far_after) {
    vec3 here = before + after - 2.0 * own;
    vec3 back = max(opposed(here, far_before + own - 2.0 * before), opposed(here, far_after + own - 2.0 * after));
    return 0.5 * back + 0.125 * abs(here);
}

// The same of its product with a colour that may be 0 on one side of the pixel: a slope is not cancelled there.
vec3 slope_error(vec3 before, vec3 after) {
    return abs(after - before) / 24.0;
}

// Is linear light that may be off by so much seen as the same?
bool is_steady(vec3 light, vec3 error) {
    vec3 change = linear_to_srgb(min(light, 1.0)) - linear_to_srgb(clamp(light - error, 0.0, 1.0));
    return max(change.r, max(change.g, change.b)) <= LEAST_CHANGE;
}
