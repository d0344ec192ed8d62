#include "common/splat_corners.glsl"
#include "common/picture.glsl"

// Brings a small surface to the size of its picture: colour decides which surface a pixel lies on, position alone
// decides its value there (the weights are those of joint bilateral upsampling: Kopf et al. 2007).

const float SAME_LAYER = 0.03;    // a sample that misses a plane by less than this share of 1/z lies on it
const float VOTE_REACH = 1.0;     // standard deviation of a vote's weight, samples
const float COLOR_REACH = 0.1;    // and in colour, 0..1
const float VALUE_REACH = 0.5;    // the same for values, samples
const float GUIDE_SPAN = 0.3333;  // samples over which their colour is averaged
const float CREASE = 0.8;         // cosine between the normals of two faces that meet in a crease
const float SAME_FACE = 0.99;     // cosine between normals of one face
const float LEAST_FACE = 4.5;     // of the 16 samples, those that a face has at least: more than one row

// A sample of the small surface, and its plane.
struct Facet {
    vec4 surface;  // unit normal and depth; depth 0 in a hole, below 0 outside of the frame, where there is nothing
    vec2 pixel;
    vec2 slope;    // of 1/z per sample
};

// The mean colour over a square `span` pixels of the picture wide, around a position of another one of this size.
vec3 mean_color(sampler2D picture, vec2 position, vec2 size, float span) {
    vec2 centre = rescale_position(position, size, vec2(textureSize(picture, 0)));
    float off = 0.5 * max(span - 1.0, 0.0);  // what is read is a pixel wide itself
    if (off == 0.0) return sample_picture(picture, centre);
    vec3 above = sample_picture(picture, centre + vec2(-off, -off)) + sample_picture(picture, centre + vec2(off, -off));
    vec3 below = sample_picture(picture, centre + vec2(-off, off)) + sample_picture(picture, centre + vec2(off, off));
    return 0.25 * (above + below);
}

// Whether the picture is fully transparent there, so that its depth counts as missing.
bool is_cut_out(sampler2D picture, vec2 position, vec2 size) {
    vec2 place = (position + 0.5) * (vec2(textureSize(picture, 0)) / size);
    return texelFetch(picture, ivec2(place), 0).a == 0.0;
}

float gaussian(vec2 off, float reach) {
    return exp(-dot(off, off) / (2.0 * reach * reach));
}

// How likely two colours belong to one surface, 0..1.
float color_likeness(vec3 a, vec3 b) {
    vec3 off = a - b;
    return exp(-dot(off, off) / (2.0 * COLOR_REACH * COLOR_REACH));
}

Facet facet_at(sampler2D surface_map, ivec2 pixel, vec4 source) {
    ivec2 last = textureSize(surface_map, 0) - 1;
    vec4 surface = pixel == clamp(pixel, ivec2(0), last) ? surface_at(surface_map, pixel) : vec4(0.0, 0.0, 0.0, -1.0);
    vec2 at = vec2(pixel);
    if (surface.w <= 0.0) return Facet(surface, at, vec2(0.0));
    return Facet(surface, at, inverse_depth_slope(surface.xyz, pixel_ray(at, source), surface.w, source));
}

// 1/z of a facet's plane.
float facet_reaches(Facet facet, vec2 at) {
    return 1.0 / facet.surface.w + dot(facet.slope, at - facet.pixel);
}

// Does a facet belong to the layer of another one? Holes form a layer, too; outside of the frame there is none.
bool shares_layer(Facet facet, Facet own) {
    if (own.surface.w <= 0.0) return own.surface.w == 0.0 && facet.surface.w == 0.0;
    return lies_on_plane(facet.surface.w, facet.pixel - own.pixel, own.surface.w, own.slope, SAME_LAYER);
}

// Whether all known samples of the 5x5 around a pixel lie on its plane, without a hole and without a crease: 1 or 0.
float is_calm(sampler2D surface_map, ivec2 pixel, vec4 source) {
    Facet own = facet_at(surface_map, pixel, source);
    bool calm = own.surface.w > 0.0;
    for (int k = 0; k < 25; ++k) {
        Facet facet = facet_at(surface_map, pixel + ivec2(k % 5 - 2, k / 5 - 2), source);
        bool alike = shares_layer(facet, own) && dot(facet.surface.xyz, own.surface.xyz) > CREASE;
        calm = calm && (facet.surface.w < 0.0 || alike);
    }
    return calm ? 1.0 : 0.0;
}

// The least of the four samples around a position: 1 if all of them are calm.
float calm_around(sampler2D calm_map, vec2 at) {
    ivec2 last = textureSize(calm_map, 0) - 1;
    float least = 1.0;
    for (int k = 0; k < 4; ++k) {
        least = min(least, texel_at(calm_map, clamp(ivec2(floor(at)) + ivec2(k % 2, k / 2), ivec2(0), last)).r);
    }
    return least;
}

// A weighted sum of normals and of 1/z, with a facet added to it.
vec4 add_facet(vec4 sum, float weight, Facet facet, vec2 at) {
    return sum + weight * vec4(facet.surface.xyz, facet_reaches(facet, at));
}

// Unit normal and depth where four calm samples surround a position: their planes, mixed by the distances.
vec4 mix_facets(sampler2D surface_map, vec2 at, vec4 source) {
    ivec2 last = textureSize(surface_map, 0) - 1;
    vec4 sum = vec4(0.0);
    float total = 0.0;
    for (int k = 0; k < 4; ++k) {
        Facet facet = facet_at(surface_map, clamp(ivec2(floor(at)) + ivec2(k % 2, k / 2), ivec2(0), last), source);
        vec2 closeness = max(1.0 - abs(at - facet.pixel), 0.0);
        float weight = closeness.x * closeness.y;
        sum = add_facet(sum, weight, facet, at);
        total += weight;
    }
    return vec4(normalize(sum.xyz), total / sum.w);
}

// The facet whose layer has most votes, from the four around a position: 16 samples vote, by distance and by colour.
Facet win_vote(sampler2D surface_map, sampler2D guide_map, Facet around[4], vec2 at, vec3 color, vec4 source) {
    vec4 votes = vec4(0.0);
    for (int k = 0; k < 16; ++k) {
        ivec2 pixel = ivec2(floor(at)) + ivec2(k % 4, k / 4) - 1;
        Facet facet = facet_at(surface_map, pixel, source);
        float vote = gaussian(at - facet.pixel, VOTE_REACH) * color_likeness(color, texel_at(guide_map, pixel).rgb);
        for (int j = 0; j < 4; ++j) votes[j] += shares_layer(facet, around[j]) ? vote : 0.0;
    }
    Facet winner = around[0];
    float most = votes[0];
    for (int j = 1; j < 4; ++j) {
        if (votes[j] > most) winner = around[j];
        most = max(most, votes[j]);
    }
    return winner;
}

// Is the face of `other` seen at a position instead of that of `own`? Of two planes that meet in a crease, the one in
// front is seen if each of the two lies in front of the other at its own sample, else the one behind.
bool is_across_crease(Facet own, Facet other, vec2 at) {
    float front = facet_reaches(own, own.pixel) - facet_reaches(other, own.pixel)
        + facet_reaches(other, other.pixel) - facet_reaches(own, other.pixel);
    return (facet_reaches(other, at) - facet_reaches(own, at)) * front > 0.0;
}

// Unit normal and depth at a position from the 16 samples around it that share a layer, of one face of it where it has a
// crease; the closest count most. own: the closest of the layer; other: the closest with another normal, or the same.
vec4 mix_layer(sampler2D surface_map, Facet layer, Facet own, Facet other, vec2 at, vec4 source) {
    vec4 both = vec4(0.0), face = vec4(0.0);
    float both_total = 0.0, face_total = 0.0;
    vec2 sizes = vec2(0.0);  // samples of the two faces
    vec3 seen = is_across_crease(own, other, at) ? other.surface.xyz : own.surface.xyz;
    for (int k = 0; k < 16; ++k) {
        Facet facet = facet_at(surface_map, ivec2(floor(at)) + ivec2(k % 4, k / 4) - 1, source);
        if (!shares_layer(facet, layer)) continue;
        float weight = gaussian(at - facet.pixel, VALUE_REACH);
        both = add_facet(both, weight, facet, at);
        both_total += weight;
        float face_weight = dot(facet.surface.xyz, seen) > CREASE ? weight : 0.0;
        face = add_facet(face, face_weight, facet, at);
        face_total += face_weight;
        sizes.x += dot(facet.surface.xyz, own.surface.xyz) > SAME_FACE ? 1.0 : 0.0;
        sizes.y += dot(facet.surface.xyz, other.surface.xyz) > SAME_FACE ? 1.0 : 0.0;
    }
    bool crease = dot(own.surface.xyz, other.surface.xyz) < CREASE && min(sizes.x, sizes.y) > LEAST_FACE;
    return crease ? vec4(normalize(face.xyz), face_total / face.w) : vec4(normalize(both.xyz), both_total / both.w);
}

// Of four facets the closest one of a layer.
Facet closest_of(Facet around[4], Facet layer, vec2 at) {
    Facet closest = layer;
    for (int j = 0; j < 4; ++j) {
        bool is_closer = distance(around[j].pixel, at) < distance(closest.pixel, at);
        if (is_closer && shares_layer(around[j], layer)) closest = around[j];
    }
    return closest;
}

// The same among those with another normal than `own`; `own` if there is none.
Facet closest_turned(Facet around[4], Facet layer, Facet own, vec2 at) {
    Facet closest = own;
    float least = 1e30;
    for (int j = 0; j < 4; ++j) {
        bool is_turned = dot(around[j].surface.xyz, own.surface.xyz) < CREASE && shares_layer(around[j], layer);
        float far = distance(around[j].pixel, at);
        if (is_turned && far < least) {
            closest = around[j];
            least = far;
        }
    }
    return closest;
}

// Unit normal and depth at a position near an edge, from the colour seen there; 0 where it shows a hole.
// guide_map: mean colour of each sample.
vec4 vote_surface(sampler2D surface_map, sampler2D guide_map, vec2 at, vec3 color, vec4 source) {
    Facet around[4];
    for (int j = 0; j < 4; ++j) around[j] = facet_at(surface_map, ivec2(floor(at)) + ivec2(j % 2, j / 2), source);
    Facet winner = win_vote(surface_map, guide_map, around, at, color, source);
    if (winner.surface.w <= 0.0) return vec4(0.0);
    Facet own = closest_of(around, winner, at);
    return mix_layer(surface_map, winner, own, closest_turned(around, winner, own, at), at, source);
}
