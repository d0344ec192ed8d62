#include "common/resolve.glsl"

// Several frames of one object, merged in a view. At each pixel the nearest splat of all frames decides what is seen; each
// frame that has the same surface there adds its part, by weight. Merging in the target: cf. Pulli et al. 1997.

const float STRETCHED = 6.0;           // target pixels for each source pixel that a splat's half may cover
const float SEEN_ALIKE = 0.2;          // radians between two directions that see a surface much alike
const float LEAST_ALIKE = 0.0005;      // weight of a frame that saw it from quite elsewhere
const float FALLBACK = 1e-11;          // weight of a frame that has no part in the surface: it only closes holes
const float FLATTEST = 0.25;           // cosine of a ray, at which differences along it count least
const float MOST_DETAIL = 4.0;         // source pixels for each target pixel, beyond which more say no more
const float MOST_SHARP = 1.5;          // the same of frames without noise, of which the sharpest counts
const float DEEP_RIM = 3.0;            // pixels of depth from a rim's pixel to where frames without noise draw it
const float SPARE = 0.6;               // trust in points that another frame shows better: they are not drawn
const float UNLIKE = 0.7;              // cosine of two normals, below which they contradict each other
const uint INVERSE_DEPTH = 0x3fffffffu; // the bits of a key that tell how far its splat is

// What the splats leave at a pixel: the level of the nearest, then its 1/z, then whether it goes on behind others in its
// frame. A higher level hides all lower ones.
uint splat_key(float inverse_depth, int level, bool hidden) {
    return hidden_mark(floatBitsToUint(inverse_depth) >> 1, hidden) | (uint(level) << 30);
}

float key_inverse_depth(uint key) {
    return uintBitsToFloat((key & INVERSE_DEPTH) << 1);
}

// Where several frames see the surface: 1/z of the nearest splat, moved by the mean of what they say, weighted.
float merged_inverse_depth(uint key, float weighted_off, float weight) {
    return key_inverse_depth(key) * (1.0 + weighted_off / weight);
}

// The normal that was found in a view (and depth: 0 where none was, negative at rims), unless the frames' own contradict
// it: then the merged depth has an outlier there, or a step where another frame begins.
vec3 target_normal(vec4 found, vec3 mixed) {
    return found.w != 0.0 && dot(found.xyz, mixed) > UNLIKE ? found.xyz : mixed;
}

// Is a splat of so many source pixels, with this half width and height, seen from so near that it spreads over others?
bool is_stretched(vec2 extent, float side) {
    return max(extent.x, extent.y) > STRETCHED * side;
}

// Is a pixel in a share of all pixels that are evenly spread? A lattice: the fractions stay even at every 2nd and 4th.
bool is_among(ivec2 pixel, float share) {
    return fract(dot(vec2(pixel), vec2(0.618034, 0.414214))) < share;
}

// The share of a frame's splats that are primary: as its importance fades, first those go that others see through.
float primary_share(float primary, float trust) {
    return clamp(2.0 * primary - (trust < 1.0 ? 1.0 : 0.0), 0.0, 1.0);
}

// Does what a target pixel shows of a rim, with this 1/z, lie deep behind or before its pixel, whose depth is z? There a
// frame guesses the surface, and others see it.
bool lies_deep(vec2 target_pixel, float inverse_depth, float z, vec4 source, mat4 view, vec4 target) {
    float w = carry_back(target_pixel, inverse_depth, target, view, source).z;
    return mean_focal_length(source) * abs(1.0 - z * w) > DEEP_RIM;
}

bool is_spare(float trust) {
    return abs(trust - SPARE) < 0.05;
}

// 0 to 3: what is trusted hides all that is not, and of either the primary views hide the others.
int splat_level(float trust, bool stretched, bool primary) {
    return (trust > 0.5 && !stretched ? 2 : 0) + (primary ? 1 : 0);
}

// Where the ray of a target pixel meets the tangent plane of a source pixel: 1/z in the target view.
float plane_inverse_depth(vec4 own, vec2 pixel, vec2 target_pixel, vec4 source, mat4 view, vec4 target) {
    vec3 ray = pixel_ray(target_pixel, target) * mat3(view);
    vec3 point = pixel_ray(pixel, source) * own.w + view[3].xyz * mat3(view);
    return dot(own.xyz, ray) / dot(own.xyz, point);
}

// What of a difference along a target pixel's ray lies across a surface: where a ray grazes it, a small error of a pose
// moves the point that is hit far along the ray.
float share_across(vec3 normal, vec2 target_pixel, mat4 view, vec4 target) {
    vec3 ray = pixel_ray(target_pixel, target) * mat3(view);
    return max(abs(dot(normal, normalize(ray))), FLATTEST);
}

// As look_up, but where the ray meets the plane of the pixel that it hits first, if that is near; and 1/z is the plane's.
Seen look_twice(
    sampler2D surface_map, float inverse_depth, bool hidden, vec2 target_pixel, vec4 source, mat4 view, vec4 target, float band
) {
    vec2 last = vec2(textureSize(surface_map, 0) - 1);
    vec2 first = clamp(floor(carry_back(target_pixel, inverse_depth, target, view, source).xy + 0.5), vec2(0.0), last);
    vec4 hit = surface_at(surface_map, ivec2(first));
    float met = plane_inverse_depth(hit, first, target_pixel, source, view, target);
    float off = (met / inverse_depth - 1.0) * share_across(hit.xyz, target_pixel, view, target);
    float start = abs(off) < band ? met : inverse_depth;
    Seen seen = look_up(surface_map, start, hidden, target_pixel, source, view, target);
    seen.inverse_depth = plane_inverse_depth(seen.own, vec2(seen.pixel), target_pixel, source, view, target);
    return seen;
}

// Whether a frame has a point at the position that was looked up.
bool part_is_known(Seen seen, vec2 size) {
    bool inside = all(greaterThan(seen.at, vec2(-0.61))) && all(lessThan(seen.at, size - 0.39));
    return inside && seen.own.w > 0.0;
}

// 1 where two depths agree, falling to 0 where they differ by the band; both are shares of 1/z across the surface.
float agreement(float off, float band) {
    float share = off / band;
    float rest = max(1.0 - share * share, 0.0);
    return rest * rest;
}

// How much a frame can say about what a target pixel shows: more if it saw it from near, from ahead, and from where the
// target sees it. is_exact: only how sharply it saw it counts.
float view_weight(Seen seen, vec2 target_pixel, vec4 source, mat4 view, vec4 target, bool is_exact) {
    vec3 from_source = normalize(pixel_ray(seen.at, source));
    vec3 from_target = normalize(pixel_ray(target_pixel, target) * mat3(view));  // source axes
    float ours = max(-dot(seen.own.xyz, from_source), 0.0), theirs = max(-dot(seen.own.xyz, from_target), MIN_COSINE);
    float closer = 1.0 / max(abs(seen.inverse_depth) * seen.own.w, 0.01);
    float detail = abs(source.x * source.y / (target.x * target.y)) * closer * closer * ours / theirs;
    float sharp = min(detail, MOST_SHARP) * ours;
    if (is_exact) return sharp * sharp;
    float turned = 2.0 * (1.0 - dot(from_source, from_target));  // angle squared, nearly
    return min(detail, MOST_DETAIL) * ours * max(exp(-turned / (SEEN_ALIKE * SEEN_ALIKE)), LEAST_ALIKE);
}

// The weight of a frame's part that has no say: it counts only where nobody has.
float fallback_weight(float off, float band) {
    float share = min(abs(off) / band, 1e4);
    return FALLBACK / (1.0 + share * share * share * share);
}
