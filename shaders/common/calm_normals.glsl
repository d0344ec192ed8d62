#include "common/splat_corners.glsl"
#include "common/toksvig.glsl"

// Calm normals, for light: what noise leaves in normals is seen as stains. The photograph and the depth say where surfaces
// end; between, normals are averaged over cells of 4x4 pixels and over more and more distant cells (edge-avoiding
// wavelets: Dammertz et al. 2010), each by how sure it is. Normals that vary evenly stay, as on spheres and cylinders.

const int SIDE = 4;               // pixels of a cell
const float PHOTO = 0.08;         // difference of the photograph's log luminance that makes a neighbour count 1/e
const float SLACK = 0.6;          // times the noise of depth, by which a surface may miss a point
const float STEEPEST_TILT = 0.5;  // radians of noise that are believed
const float LEAST_TILT = 0.004;   // radians of noise that every normal has
const float COMPLETED_TILT = 0.35;  // radians: of normals that nobody measured
const float OUTLIER = 3.0;        // standard deviations from the others, from which on a normal counts less
const float FAR_OUTLIER = 7.0;    // from a pixel's own normal: noise is underrated, but such a difference is a shape
const float FLAT_OUTLIER = 1.2;   // from its own normal, where the photograph says nothing
const float RIDGE = 0.05;         // of the places' variance: few places have no slope
const float DARK = 0.05;          // brightness below which the photograph tells nothing

// What a pixel, or a cell of pixels, knows of its surface.
struct Facet {
    vec3 point;       // camera axes; depth 0: nothing
    vec3 normal;
    float luminance;  // of the photograph, its logarithm
    float tilt;       // standard deviation of the normal, radians
    bool is_blind;    // is the photograph the same all around, without any noise? then it is no witness
};

// surface_map: normal and depth; witness_map: luminance and tilt, negative where it is blind. Pixels `side` apart.
Facet facet_at(sampler2D surface_map, sampler2D witness_map, ivec2 place, float side, vec4 intrinsics) {
    ivec2 inside = clamp(place, ivec2(0), textureSize(surface_map, 0) - 1);
    vec4 surface = inside == place ? surface_at(surface_map, inside) : vec4(0.0);
    vec2 seen = texel_at(witness_map, inside).xy;
    vec2 pixel = side * vec2(place) + 0.5 * (side - 1.0);
    return Facet(pixel_ray(pixel, intrinsics) * surface.w, surface.xyz, seen.x, abs(seen.y), seen.y < 0.0);
}

bool is_facet(Facet facet) {
    return facet.point.z > 0.0 && facet.normal != vec3(0.0);
}

// By how many standard deviations, squared and halved, does another facet miss the own surface? noise: of depth, over depth
float strangeness(Facet own, Facet other, float noise, vec4 intrinsics) {
    vec3 way = other.point - own.point;
    float off = min(abs(dot(way, own.normal)), abs(dot(way, other.normal)));
    float tilt = min(own.tilt + other.tilt, STEEPEST_TILT);
    float slack = (SLACK * noise + 0.5 / mean_focal_length(intrinsics)) * own.point.z + tilt * length(way);
    off /= slack;
    return 0.5 * off * off + abs(other.luminance - own.luminance) * (1.0 / PHOTO);
}

// The logarithm of the photograph's brightness (x), and the tilt of the normal (y).
vec2 witness_of(vec3 color, float certainty, bool is_measured) {
    float brightness = sqrt(dot(color * color, vec3(0.2126, 0.7152, 0.0722)));  // of the eye: near the power of sRGB
    float tilt = sqrt((1.0 / max(certainty, 0.05) - 1.0) / WANDERING);  // see normal_certainty.frag
    return vec2(2.2 * log(max(brightness, DARK)), max(tilt, is_measured ? LEAST_TILT : COMPLETED_TILT));
}

// Of the pixels of a cell: the surest of the four in its middle, or else the last one, and those that belong to it.
// normal, depth in the cell's middle
vec4 join_facets(
    sampler2D surface_map, sampler2D witness_map, ivec2 cell, float noise, vec4 intrinsics, out vec2 joined
) {
    Facet own = Facet(vec3(0.0), vec3(0.0), 0.0, 1e30, true);
    for (int k = 0; k < 4; ++k) {
        ivec2 pixel = SIDE * cell + SIDE / 2 - ivec2(k % 2, k / 2);
        Facet facet = facet_at(surface_map, witness_map, pixel, 1.0, intrinsics);
        if (is_facet(facet) && facet.tilt < own.tilt) own = facet;
    }
    for (int k = 0; k < SIDE * SIDE && !is_facet(own); ++k) {
        own = facet_at(surface_map, witness_map, SIDE * cell + ivec2(k % SIDE, k / SIDE), 1.0, intrinsics);
    }
    float s = 0.0, luminance = 0.0, darkest = 1e30, brightest = -1e30;
    vec3 normal = vec3(0.0), point = vec3(0.0);
    for (int k = 0; k < SIDE * SIDE; ++k) {
        Facet facet = facet_at(surface_map, witness_map, SIDE * cell + ivec2(k % SIDE, k / SIDE), 1.0, intrinsics);
        float m = is_facet(facet) ? exp(-strangeness(own, facet, noise, intrinsics)) / (facet.tilt * facet.tilt) : 0.0;
        darkest = min(darkest, facet.luminance);
        brightest = max(brightest, facet.luminance);
        s += m;
        normal += m * facet.normal;
        point += m * facet.point;
        luminance += m * facet.luminance;
    }
    joined = vec2(luminance / s, darkest == brightest ? -own.tilt : own.tilt);
    if (!is_facet(own)) return vec4(0.0);
    vec3 ray = pixel_ray(float(SIDE) * vec2(cell) + 0.5 * float(SIDE - 1), intrinsics);
    float depth = dot(normal, point / s) / dot(normal, ray);
    bool is_near = abs(depth * s / point.z - 1.0) < 0.1;
    return vec4(normalize(normal), is_near ? depth : point.z / s);
}

// A cell among those around, `stride` apart: first the mean of those on its surface, then, without those that miss the
// mean, the value at its own place of what varies evenly. is_shared: do neighbours this near share their noise?
vec4 calm_facet(
    sampler2D surface_map, sampler2D witness_map, ivec2 cell, int stride, float noise, vec4 intrinsics, bool is_shared, out vec2 left
) {
    Facet own = facet_at(surface_map, witness_map, cell, float(SIDE), intrinsics);
    left = texel_at(witness_map, cell).xy;
    if (!is_facet(own)) return vec4(0.0);
    float weights[9], tilts[9], total = 0.0;
    vec3 normals[9], mean = vec3(0.0);
    for (int k = 0; k < 9; ++k) {
        ivec2 off = ivec2(k % 3, k / 3) - 1;
        Facet other = facet_at(surface_map, witness_map, cell + stride * off, float(SIDE), intrinsics);
        float far = 0.69 * float(off.x * off.x + off.y * off.y);  // about 1 2 1
        float m = exp(-far - strangeness(own, other, noise, intrinsics)) / (other.tilt * other.tilt);
        weights[k] = is_facet(other) ? m : 0.0;
        tilts[k] = other.tilt * other.tilt;
        normals[k] = other.normal;
        mean += weights[k] * other.normal;
        total += weights[k];
    }
    float outlier = own.is_blind ? FLAT_OUTLIER * FLAT_OUTLIER : OUTLIER * OUTLIER;
    float spread = own.is_blind ? 0.0 : 0.5 * max(1.0 - dot(mean, mean) / (total * total), 0.0);
    vec3 expected = own.is_blind ? own.normal : normalize(mean);
    float s = 0.0, su = 0.0, sv = 0.0, suu = 0.0, suv = 0.0, svv = 0.0, squares = 0.0;
    vec3 sn = vec3(0.0), sun = vec3(0.0), svn = vec3(0.0);
    for (int k = 0; k < 9; ++k) {
        float x = float(k % 3 - 1), y = float(k / 3 - 1);
        vec3 miss = normals[k] - expected;
        float m = weights[k] * exp(-0.5 * dot(miss, miss) / (outlier * (own.tilt * own.tilt + tilts[k]) + spread));
        vec3 n = m * normals[k];
        s += m;
        su += m * x;
        sv += m * y;
        suu += m * x * x;
        suv += m * x * y;
        svv += m * y * y;
        sn += n;
        sun += n * x;
        svn += n * y;
        squares += m * m * tilts[k];
    }
    float u = su / s, v = sv / s;
    mean = sn / s;
    vec3 un = sun / s - u * mean, vn = svn / s - v * mean;
    float uu = suu / s - u * u + RIDGE, vv = svv / s - v * v + RIDGE, uv = suv / s - u * v;
    vec3 slope_u = (vv * un - uv * vn) / (uu * vv - uv * uv), slope_v = (uu * vn - uv * un) / (uu * vv - uv * uv);
    vec3 here = mean - u * slope_u - v * slope_v;
    float rest = 0.5 * max(1.0 - dot(mean, mean) - dot(slope_u, un) - dot(slope_v, vn), 0.0);
    float variance = max(squares, rest * s * s / 9.0) / (s * s);  // they may miss the plane by more than their tilts say
    if (own.is_blind || !is_shared) left.y *= min(sqrt(variance) / own.tilt, 1.0);
    if (abs(left.y) < LEAST_TILT) left.y = sign(left.y) * LEAST_TILT;
    return vec4(normalize(length(here) > 0.1 ? here : mean), texel_at(surface_map, cell).w);
}

// The normal of a pixel: its own, and those of the four cells around. own_share: of what its variance says it counts
vec3 calm_normal(
    sampler2D surface_map, sampler2D witness_map, sampler2D other_map, sampler2D joined_map, ivec2 pixel, float noise,
    float own_share, vec4 intrinsics
) {
    Facet own = facet_at(surface_map, witness_map, pixel, 1.0, intrinsics);
    vec2 at = (vec2(pixel) - 0.5 * float(SIDE - 1)) / float(SIDE);
    ivec2 low = ivec2(floor(at));
    vec2 share = at - vec2(low);
    vec3 sum = vec3(0.0);
    bool is_blind = texel_at(joined_map, pixel / SIDE).y < 0.0;
    float doubt = own.tilt * own.tilt, outlier = is_blind ? FLAT_OUTLIER * FLAT_OUTLIER : FAR_OUTLIER * FAR_OUTLIER;
    for (int k = 0; k < 4; ++k) {
        ivec2 off = ivec2(k % 2, k / 2);
        Facet cell = facet_at(other_map, joined_map, low + off, float(SIDE), intrinsics);
        vec2 near = mix(1.0 - share, share, vec2(off));
        vec3 miss = cell.normal - own.normal;
        float variance = cell.tilt * cell.tilt;
        float strange = strangeness(own, cell, noise, intrinsics) + 0.5 * dot(miss, miss) / (outlier * (doubt + variance));
        float m = near.x * near.y * exp(-strange) / variance;
        sum += is_facet(cell) ? m * cell.normal : vec3(0.0);
    }
    sum = max(doubt - LEAST_TILT * LEAST_TILT, 0.0) * sum + (is_blind ? 1.0 : own_share) * own.normal;
    return is_facet(own) ? normalize(sum) : own.normal;
}
