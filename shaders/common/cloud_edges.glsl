#include "common/cloud_planes.glsl"

// At a sharp edge the best plane through a point is one that a neighbour has found on its own side of the edge. All
// lengths are in radii, and the noise is squared.

const float OWN = 6.0;        // squares of the noise that a point may lie off its plane
const float SLAB = 2.0;       // thicknesses of a plane: what lies within is fitted again
const float NOISY = 2.5;      // the same, of the noise
const float THINNEST = 0.02;  // the same, at least
const int TRIMS = 3;          // fits without what lies off the one before
const float TRIMMED = 0.4;    // of the thickness before: more was no stray points

// What a plane costs at the point: its thickness and how far it lies off, squared, as far as that is no noise. Without a
// plane: that of none.
float cost_of(vec4 plane, float noise) {
    float thickness = length(plane.xyz) - 1.0;
    if (thickness < -0.5) return THICKEST * THICKEST;
    return thickness * thickness + max(plane.w * plane.w - OWN * noise, 0.0);
}

// The plane of a neighbour at d, as the point sees it; unit: the lengths in which planes are kept, in radii.
vec4 plane_from(vec4 plane, vec3 d, float unit) {
    float size = length(plane.xyz);
    if (size < 0.5) return plane;
    vec3 n = plane.xyz / size;
    return vec4(n * (1.0 + (size - 1.0) * unit), plane.w * unit + dot(n, d));
}

// The plane of least cost among those of the neighbours within the radius; 0 if none costs less than `least`.
vec4 elect_plane(sampler2D point_map, sampler2D plane_map, isampler2D range_map, int cell, vec3 here, float least,
        float noise, float radius, float unit, int most) {
    vec4 best = vec4(0.0);
    float scale = 1.0 / radius;
    for (int k = 0; k < 9; ++k) {
        ivec2 range = texelFetch(range_map, cloud_texel(9 * cell + k), 0).xy;
        int stride = 1 + (range.y - range.x - 1) / most;
        for (int i = range.x; i < range.y; i += stride) {
            vec3 d = (texelFetch(point_map, cloud_texel(i), 0).xyz - here) * scale;
            vec4 plane = plane_from(texelFetch(plane_map, cloud_texel(i), 0), d, unit);
            float cost = cost_of(plane, noise);
            if (cost < least && dot(d, d) < 1.0) {
                least = cost;
                best = plane;
            }
        }
    }
    return best;
}

// The slab round a plane whose points are fitted again, see gather_moments.
vec4 slab_of(vec4 plane, float noise) {
    float size = length(plane.xyz);
    float reach = max(max(SLAB * (size - 1.0), NOISY * sqrt(noise)), THINNEST);
    return vec4(plane.xyz / max(size, 1e-20), plane.w) / reach;
}

// Whether a plane is so much thinner than the one before that stray points explain the difference.
bool is_thinner(vec4 plane, vec4 before) {
    return plane.xyz != vec3(0.0) && length(plane.xyz) - 1.0 <= TRIMMED * (length(before.xyz) - 1.0);
}

const int NEAREST = 6;  // neighbours that tell how far a splat may reach

// How far the NEAREST neighbours are, radii, at most 1; and how alike their planes lie: the mean cosine.
vec2 nearest_points(sampler2D point_map, sampler2D plane_map, isampler2D range_map, int cell, vec3 here, vec3 own,
        float radius, int most) {
    float near[NEAREST], alike[NEAREST];  // ascending; squared
    for (int j = 0; j < NEAREST; ++j) {
        near[j] = 1.0;
        alike[j] = 0.0;
    }
    float scale = 1.0 / radius, size = length(own);
    for (int k = 0; k < 9; ++k) {
        ivec2 range = texelFetch(range_map, cloud_texel(9 * cell + k), 0).xy;
        int stride = 1 + (range.y - range.x - 1) / most;
        for (int i = range.x; i < range.y; i += stride) {
            vec3 d = (texelFetch(point_map, cloud_texel(i), 0).xyz - here) * scale;
            float distance2 = dot(d, d);
            if (distance2 >= near[NEAREST - 1] || distance2 == 0.0) continue;
            vec3 other = texelFetch(plane_map, cloud_texel(i), 0).xyz;
            int j = NEAREST - 1;
            for (; j > 0 && near[j - 1] > distance2; --j) {
                near[j] = near[j - 1];
                alike[j] = alike[j - 1];
            }
            near[j] = distance2;
            alike[j] = abs(dot(other, own)) / max(size * length(other), 1e-20);
        }
    }
    float sum = 0.0;
    for (int j = 0; j < NEAREST; ++j) sum += alike[j];
    return vec2(sqrt(near[NEAREST - 1]), sum / float(NEAREST));
}
