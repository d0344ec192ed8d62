#include "common/camera.glsl"
#include "common/texels.glsl"

// How much of the light from all around reaches a point of a frame, and from where: as its neighbours hide it. In one plane
// through the eye and the point, what they hide is marked in a mask of 32 sectors (Therrien, Levesque, Gilet, "Screen Space
// Indirect Lighting with Visibility Bitmask", 2023); 16 neighbours look along 16 such planes, whose mean is the answer.

const int SECTORS = 32;
const int STEPS = 10;        // to each side
const int PLANES = 4;        // along a side of the square of pixels that look along different planes
const float THIN = 0.12;     // of the radius: how thick any occluder is
const float STEEP = 4.0;     // what goes farther back from step to step, by their distance, is another surface
const float MISSED = 1e15;    // farther than anything
const float ON_PLANE = 0.01; // share of the depth by which neighbours lie on one surface

// Where a pixel's plane lies, in turns of half a circle, and by how much its steps are shifted.
vec2 plane_of(ivec2 pixel) {
    return vec2(float((((pixel.x + pixel.y) & 3) << 2) + (pixel.x & 3)) / 16.0, float((pixel.y - pixel.x) & 3) / 4.0);
}

// Sectors from one place to another, both from 0 to 1 across the mask, as bits.
uint sector_bits(float from, float to) {
    int first = int(floor(min(from, to) * float(SECTORS) + 0.5));
    int count = int(floor(max(from, to) * float(SECTORS) + 0.5)) - first;
    if (count <= 0) return 0u;
    return (0xFFFFFFFFu >> uint(SECTORS - count)) << uint(min(first, SECTORS - 1));
}

// Where a direction in the plane lies across the mask: in equal steps of the sine of its angle to the normal. Its parts
// along the normal and across it, of any length; below the surface it is at an end, that of its side of the eye's ray.
float sector_place(vec2 direction, float end) {
    float across = direction.y * inversesqrt(max(dot(direction, direction), 1e-20));
    return direction.x > 0.0 ? 0.5 + 0.5 * across : end;
}

// How many bits are set in each group of four, each in its own four bits.
uint bits_in_fours(uint bits) {
    uint pairs = bits - ((bits >> 1u) & 0x55555555u);
    return (pairs & 0x33333333u) + ((pairs >> 2u) & 0x33333333u);
}

// A plane through the eye and a point, and what is hidden in it.
struct Plane {
    vec2 way;      // in the picture
    vec3 across;   // along the surface; the normal's part in the plane is m
    vec3 m;
    float share;   // of the normal that lies in the plane
    vec2 v;        // towards the eye, as parts along m and across
    vec2 tilt;     // of both towards the side, at right angles to the eye's ray
    uint hidden;
};

// The plane of a pixel, turned by a share of half a circle.
Plane plane_through(ivec2 pixel, float turned, vec3 point, vec3 n, vec4 intrinsics) {
    vec3 v = normalize(-point);
    float angle = (plane_of(pixel).x + turned) * 3.14159265;
    vec2 way = vec2(cos(angle), sin(angle));
    vec3 along = vec3(way / intrinsics.xy, 0.0);
    vec3 t = normalize(along - v * dot(along, v));
    vec2 normal = vec2(dot(n, v), dot(n, t));
    float share = length(normal);
    normal = share > 0.0 ? normal / share : vec2(1.0, 0.0);
    vec3 m = normal.x * v + normal.y * t, across = normal.x * t - normal.y * v;
    return Plane(way, across, m, share, vec2(normal.x, -normal.y), vec2(normal.y, normal.x), 0u);
}

// Where step k of a plane lies in the picture; reach: the radius there, pixels.
vec2 step_place(ivec2 pixel, ivec2 texel, Plane plane, int k, float reach) {
    float i = float(k % STEPS), far = (i + plane_of(pixel).y) / float(STEPS);
    float offset = max(far * far * reach, 1.5 + i);
    return floor(vec2(texel) + (k < STEPS ? offset : -offset) * plane.way + 0.5);
}

// What a ray meets of a surface that is seen at a place of the picture, and goes on as a plane beyond its border; far away
// if it meets nothing.
vec3 met_at(vec4 surface, vec2 place, vec2 at, vec4 intrinsics) {
    vec3 ray = pixel_ray(at, intrinsics);
    float z = abs(surface.w);
    if (place != at) z *= dot(surface.xyz, pixel_ray(place, intrinsics)) / dot(surface.xyz, ray);
    return z > 0.0 ? ray * z : vec3(MISSED);
}

// The sectors that something hides, away from the point and so thick, at step k.
uint hidden_by(vec3 away, Plane plane, int k, float thickness) {
    float end = float(1 - k / STEPS);
    vec2 front = vec2(dot(away, plane.m), dot(away, plane.across));
    return sector_bits(sector_place(front, end), sector_place(front - thickness * plane.v, end));
}

// How wide a surface is along a plane up to a step, if it goes on from the last one; what is wider is thicker, too.
float run_of(float run, vec3 step, vec3 v) {
    float deep = dot(step, v), wide = sqrt(max(dot(step, step) - deep * deep, 0.0));
    return abs(deep) < STEEP * wide && wide < 1e-5 * MISSED ? run + wide : 0.0;
}

// The sum of some directions of a plane, weighted by the cosine to the normal, and of their weights.
vec4 sum_of_sectors(Plane plane, uint sectors) {
    uint fours = bits_in_fours(sectors);
    vec4 sum = vec4(0.0);
    for (int k = 0; k < 8; ++k) {
        float sine = (float(k) - 3.5) / 4.0;
        vec2 direction = vec2(sqrt(1.0 - sine * sine), sine);
        float weight = float((fours >> uint(4 * k)) & 15u) * abs(dot(direction, plane.tilt));
        sum += weight * vec4(direction.x * plane.m + direction.y * plane.across, 1.0);
    }
    return sum * plane.share / 16.0;
}

// The same of all directions of a plane: their weights alone.
float weight_of_plane(Plane plane) {
    float sum = 0.0;
    for (int k = 0; k < 4; ++k) {
        float sine = (float(k) + 0.5) / 4.0, cosine = sqrt(1.0 - sine * sine);
        sum += abs(dot(vec2(cosine, sine), plane.tilt)) + abs(dot(vec2(cosine, -sine), plane.tilt));
    }
    return sum * plane.share / 4.0;
}

// What hides light along one plane through a pixel, in a view of several objects, of which one may not count: that of this
// number. surface_map: unit normal and depth; numbers_map: the object's number in w; own: normal and depth of the point at
// a texel; radius: how far occluders may be; pixel and turned decide which plane it is. Surfaces go on beyond the picture.
Plane look_among(
    sampler2D surface_map, sampler2D numbers_map, bool some_count, float number, ivec2 pixel, ivec2 texel, vec4 own,
    vec4 intrinsics, float radius, float turned
) {
    vec3 point = pixel_ray(vec2(texel), intrinsics) * abs(own.w), v = normalize(-point);
    Plane plane = plane_through(pixel, turned, point, own.xyz / max(length(own.xyz), 1e-4), intrinsics);
    float reach = radius * mean_focal_length(intrinsics) / abs(own.w);
    vec2 last = vec2(textureSize(surface_map, 0) - 1);
    int steps = own.w != 0.0 ? 2 * STEPS : 0;  // a loop that no pixel takes costs software drivers nothing
    vec3 before = vec3(0.0);
    float run = 0.0;
    for (int k = 0; k < steps; ++k) {
        vec2 at = step_place(pixel, texel, plane, k, reach), place = clamp(at, vec2(0.0), last);
        vec3 away = met_at(texel_at(surface_map, ivec2(place)), place, at, intrinsics) - point;
        bool starts = k == STEPS;  // to the other side
        run = run_of(starts ? 0.0 : run, starts ? away : away - before, v);
        before = away;
        bool counts = dot(away, away) < radius * radius;
        if (some_count) counts = counts && texel_at(numbers_map, ivec2(place)).w != number;
        plane.hidden |= counts ? hidden_by(away, plane, k, THIN * radius + run) : 0u;
    }
    return plane;
}

// The same where all that is seen counts.
Plane look_along(
    sampler2D surface_map, ivec2 pixel, ivec2 texel, vec4 own, vec4 intrinsics, float radius, float turned
) {
    return look_among(surface_map, surface_map, false, 0.0, pixel, texel, own, intrinsics, radius, turned);
}

// What is left when a share of the light is hidden that comes from these directions: the bent normal, the share.
vec4 without(vec4 hidden, vec3 n) {
    float share = clamp(1.0 - hidden.w, 0.0, 1.0);
    if (share < 1e-3) return vec4(2.0 / 3.0 * n, 0.0);
    vec3 bent = (2.0 / 3.0 * n - hidden.xyz) / share;
    return vec4(bent / max(length(bent), 1.0), share);
}

// The visibility of a point that stands alone, from its one plane: the mean of many, along other planes, is its own.
vec4 seen_from_plane(
    sampler2D surface_map, ivec2 pixel, ivec2 texel, vec4 own, vec4 intrinsics, float radius, float turned
) {
    Plane plane = look_along(surface_map, pixel, texel, own, intrinsics, radius, turned);
    return without(sum_of_sectors(plane, plane.hidden) / max(weight_of_plane(plane), 1e-4), own.xyz);
}

// What is hidden, from the planes of a square of pixels, of those on the same surface: the sum of the directions and of their
// weights, by the weight of the planes. Of a picture with every `stride`-th pixel.
vec4 mean_hidden(
    sampler2D plane_map, sampler2D weight_map, bool has_weights, sampler2D surface_map, ivec2 pixel, int first, int stride,
    vec4 intrinsics
) {
    ivec2 size = textureSize(plane_map, 0), last = textureSize(surface_map, 0) - 1;
    ivec2 texel = min(pixel * stride, last);
    vec4 own = texel_at(surface_map, texel);
    vec3 point = pixel_ray(vec2(texel), intrinsics) * abs(own.w);
    vec4 sum = vec4(0.0);
    float total = 0.0;
    int count = own.w != 0.0 ? PLANES * PLANES : 0;
    for (int k = 0; k < count; ++k) {
        ivec2 place = clamp(pixel + ivec2(k % PLANES, k / PLANES) + first, ivec2(0), size - 1);
        ivec2 other = min(place * stride, last);
        vec4 there = texel_at(surface_map, other);
        float z = abs(there.w), alike = max(dot(there.xyz, own.xyz), 0.0);
        float off = dot(own.xyz, pixel_ray(vec2(other), intrinsics) * z - point);
        bool counts = z > 0.0 && abs(off) < ON_PLANE * abs(own.w);
        float weight = counts ? alike * alike * alike * alike : 0.0;
        sum += counts ? weight * texel_at(plane_map, place) : vec4(0.0);
        if (has_weights && counts) weight *= texel_at(weight_map, place).r;
        total += weight;
    }
    return total > 0.0 ? sum / total : vec4(0.0);
}

// The visibility of any pixel of the picture, from the means around it that belong to its surface.
vec4 visibility_at(sampler2D mean_map, sampler2D surface_map, ivec2 texel, int stride, vec4 intrinsics) {
    ivec2 last = textureSize(surface_map, 0) - 1, end = textureSize(mean_map, 0) - 1;
    vec4 own = texel_at(surface_map, texel);
    vec3 point = pixel_ray(vec2(texel), intrinsics) * abs(own.w);
    vec2 at = vec2(texel) / float(stride);
    ivec2 low = ivec2(floor(at));
    vec4 sum = vec4(0.0);
    float total = 0.0;
    int count = own.w != 0.0 ? 4 : 0;
    for (int k = 0; k < count; ++k) {
        ivec2 cell = low + ivec2(k & 1, k >> 1), place = clamp(cell, ivec2(0), end);
        ivec2 other = min(place * stride, last);
        float z = abs(texel_at(surface_map, other).w);
        float off = dot(own.xyz, pixel_ray(vec2(other), intrinsics) * z - point) / (ON_PLANE * abs(own.w));
        vec2 near = 1.0 - abs(at - vec2(cell));
        float weight = z > 0.0 ? (near.x * near.y + 1e-3) / (1.0 + off * off * off * off) : 0.0;
        sum += weight > 0.0 ? weight * texel_at(mean_map, place) : vec4(0.0);
        total += weight;
    }
    return without(total > 0.0 ? sum / total : vec4(0.0), own.xyz);
}
