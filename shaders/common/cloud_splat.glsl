#include "common/camera.glsl"

// What is drawn of a point of a cloud: a disc on its surface, or a ball where it has none. Target axes, world units.
struct CloudSplat {
    vec3 centre;
    vec3 normal;   // unit, towards the viewer; 0: a ball
    float radius;
};

struct SplatHit {
    float depth;    // of what the pixel's ray meets; 0: it misses
    float outside;  // squared distance from the middle, in radii
    vec3 normal;    // unit, towards the viewer
};

const float GRAZING = 0.12;  // cosine: discs seen flatter are turned to it, or they would end in spikes
const float NEAREST_SPLAT = 2.0;  // radii from the viewer: nearer splats would fill the picture

// The normal turned to the viewer.
vec3 facing(vec3 normal, vec3 centre) {
    return dot(normal, centre) > 0.0 ? -normal : normal;
}

// A normal that faces the viewer, no flatter to its ray than GRAZING.
vec3 steeper(vec3 n, vec3 centre) {
    vec3 ray = normalize(centre);
    float cosine = -dot(n, ray);
    if (cosine >= GRAZING) return n;
    vec3 across = n + cosine * ray;  // the part of the normal that is seen from the side
    return normalize(across) * sqrt(1.0 - GRAZING * GRAZING) - GRAZING * ray;
}

// How many pixels the splat reaches from its projected middle, along both axes.
vec2 splat_extent(CloudSplat splat, vec4 intrinsics) {
    vec3 c = splat.centre;
    vec3 along_u = intrinsics.x / c.z * vec3(1.0, 0.0, -c.x / c.z);  // pixels a unit of length, to first order
    vec3 along_v = intrinsics.y / c.z * vec3(0.0, 1.0, -c.y / c.z);
    along_u -= splat.normal * dot(splat.normal, along_u);
    along_v -= splat.normal * dot(splat.normal, along_v);
    float nearer = c.z / (c.z - min(splat.radius, 0.5 * c.z));  // the near half of it looks larger
    return splat.radius * nearer * vec2(length(along_u), length(along_v));
}

// Where the ray of the pixel that lies `offset` pixels beside the projected middle meets the ball. The offset keeps
// its digits where the viewer is a thousand radii away, as the sun is.
SplatHit hit_ball(CloudSplat splat, vec2 offset, vec4 intrinsics) {
    vec3 beside = vec3(offset / intrinsics.xy, 0.0);
    vec3 ray = splat.centre / splat.centre.z + beside;
    float along = dot(beside, ray) / dot(ray, ray);
    vec3 closest = splat.centre.z * (beside - along * ray);  // from the centre to where the ray passes it
    float outside = dot(closest, closest) / (splat.radius * splat.radius);
    if (outside > 1.0) return SplatHit(0.0, outside, vec3(0.0));
    float inside = splat.radius * sqrt(1.0 - outside) / length(ray);
    vec3 normal = (closest - inside * ray) / splat.radius;
    return SplatHit(splat.centre.z * (1.0 - along) - inside, outside, normal);
}

// The same of a disc that lies in the plane with the unit normal n. `edge`: the unit direction in which its surface
// goes on; beside it nothing is known, so the disc ends at its middle; 0 for a whole disc. The middle pixel is always
// met, however thin the disc is seen.
SplatHit hit_disc(CloudSplat splat, vec3 n, vec3 edge, vec2 offset, vec4 intrinsics) {
    vec3 beside = vec3(offset / intrinsics.xy, 0.0);
    vec3 ray = splat.centre / splat.centre.z + beside;
    // the plane is met at centre.z + rise: (ray * t - centre) . n = 0
    float rise = -splat.centre.z * dot(n, beside) / dot(n, ray);
    rise = clamp(rise, -2.0 * splat.radius, 2.0 * splat.radius);
    vec3 from = splat.centre.z * beside + rise * ray;
    float outside = dot(from, from) / (splat.radius * splat.radius);
    bool is_middle = max(abs(offset.x), abs(offset.y)) <= 0.5;
    bool is_cut = dot(from, edge) < 0.0;
    if ((outside > 1.0 || is_cut) && !is_middle) return SplatHit(0.0, outside, splat.normal);
    return SplatHit(splat.centre.z + rise, min(outside, 1.0), splat.normal);
}

const float OUTLINE = 0.5;  // cosine: beyond, the neighbours tell which side is out

// A unit normal at an outline, which looks away from the sum of the normals around it: turned round, and no more away
// from the viewer than sideways. `ray`: unit.
vec3 outline_normal(vec3 normal, vec3 beside, vec3 ray) {
    if (dot(normal, beside) >= 0.0) return normal;
    return normalize(dot(normal, ray) * ray - normal);
}

// How much a hit counts where splats lie over each other: most in the middle, and a little at the rim, where only the
// middle pixel of a thin disc is.
float hit_weight(float outside) {
    float inside = 1.0 - outside;
    return inside * inside + 1e-4;
}

// How much its normal counts: the more it faces the viewer. Behind an outline nobody knows which side is out.
float facing_weight(vec3 normal, vec3 centre) {
    float cosine = dot(normal, normalize(centre));
    return cosine * cosine + 1e-4;
}
