#include "common/corners.glsl"
#include "common/picture.glsl"

// Brings a small surface to the size of its picture: colour decides which surface a pixel lies on, position alone
// decides its value there (the weights are those of joint bilateral upsampling: Kopf et al. 2007).

const float SAME_LAYER = 0.03;   // a sample that misses a plane by less than this share of 1/z lies on it
const float VOTE_REACH = 1.0;    // standard deviation of a vote's weight, depth pixels
const float COLOR_REACH = 0.1;   // and in colour, 0..1
const float VALUE_REACH = 0.5;   // the same for the values, depth pixels
const float GUIDE_SPAN = 0.3333; // depth pixels over which a sample's colour is averaged

// The mean colour over a square `span` pixels of the picture wide, around a position of another one of this size.
vec3 mean_color(sampler2D picture, vec2 position, vec2 size, float span) {
    vec2 centre = rescale_position(position, size, vec2(textureSize(picture, 0)));
    float off = 0.5 * max(span - 1.0, 0.0);  // each sample is a pixel wide itself
    if (off == 0.0) return sample_picture(picture, centre);
    return 0.25 * (sample_picture(picture, centre + vec2(-off, -off)) + sample_picture(picture, centre + vec2(off, -off))
        + sample_picture(picture, centre + vec2(-off, off)) + sample_picture(picture, centre + vec2(off, off)));
}

float gaussian(vec2 off, float reach) {
    return exp(-dot(off, off) / (2.0 * reach * reach));
}

// How likely two colours belong to one surface, 0..1.
float color_likeness(vec3 a, vec3 b) {
    vec3 off = a - b;
    return exp(-dot(off, off) / (2.0 * COLOR_REACH * COLOR_REACH));
}

// Depth below 0 outside of the frame, where there is neither a surface nor a hole.
vec4 sample_at(sampler2D surface_map, ivec2 pixel) {
    ivec2 last = textureSize(surface_map, 0) - 1;
    return pixel == clamp(pixel, ivec2(0), last) ? surface_at(surface_map, pixel) : vec4(0.0, 0.0, 0.0, -1.0);
}

vec2 sample_slope(vec4 surface, ivec2 pixel, vec4 source) {
    return inverse_depth_slope(surface.xyz, pixel_ray(vec2(pixel), source), surface.w, source);
}

// Is a sample, this many pixels off, part of the layer of another one? Holes form a layer, too.
bool shares_layer(vec4 surface, vec2 off, vec4 own, vec2 slope) {
    if (own.w == 0.0) return surface.w == 0.0;
    return lies_on_plane(surface.w, off, own.w, slope, SAME_LAYER);
}

// Whether all known samples of the 5x5 around a pixel lie on its plane, without a hole: 1 or 0.
float is_calm(sampler2D surface_map, ivec2 pixel, vec4 source) {
    vec4 own = surface_at(surface_map, pixel);
    vec2 slope = sample_slope(own, pixel, source);
    bool calm = own.w > 0.0;
    for (int k = 0; k < 25; ++k) {
        ivec2 off = ivec2(k % 5 - 2, k / 5 - 2);
        vec4 there = sample_at(surface_map, pixel + off);
        calm = calm && (there.w < 0.0 || shares_layer(there, vec2(off), own, slope));
    }
    return calm ? 1.0 : 0.0;
}

// Unit normal and depth where four calm samples surround a position: their planes, mixed by the distances.
vec4 mix_planes(Corners corners, vec2 at, vec4 source) {
    ivec2 low = corners.low, high = corners.high;
    ivec2 pixels[4] = ivec2[4](low, ivec2(high.x, low.y), ivec2(low.x, high.y), high);
    vec4 surfaces[4] = vec4[4](corners.a, corners.b, corners.c, corners.d);
    vec4 sum = vec4(0.0);
    float total = 0.0;
    for (int k = 0; k < 4; ++k) {
        vec2 off = at - vec2(pixels[k]);
        vec2 closeness = max(1.0 - abs(off), 0.0);
        float weight = closeness.x * closeness.y;
        float w = 1.0 / surfaces[k].w + dot(sample_slope(surfaces[k], pixels[k], source), off);
        sum += weight * vec4(surfaces[k].xyz, w);
        total += weight;
    }
    return vec4(normalize(sum.xyz), total / sum.w);
}

// Unit normal and depth at a position that may lie near an edge, from the colour seen there; 0 where it shows a hole.
// guide_map: mean colour of each sample.
vec4 vote_surface(sampler2D surface_map, sampler2D guide_map, vec2 at, vec3 color, vec4 source) {
    ivec2 first = ivec2(floor(at)) - 1;
    vec4 surfaces[16];
    float votes[16];
    for (int k = 0; k < 16; ++k) {
        ivec2 pixel = first + ivec2(k % 4, k / 4);
        surfaces[k] = sample_at(surface_map, pixel);
        vec2 off = at - vec2(pixel);
        float vote = gaussian(off, VOTE_REACH) * color_likeness(color, surface_at(guide_map, pixel).rgb);
        votes[k] = surfaces[k].w < 0.0 ? 0.0 : vote;
    }
    float most = 0.0;
    int winner = -1;
    for (int j = 0; j < 4; ++j) {
        int own = 5 + j % 2 + 4 * (j / 2);  // the four nearest
        if (surfaces[own].w < 0.0) continue;
        ivec2 place = ivec2(own % 4, own / 4);
        vec2 slope = sample_slope(surfaces[own], first + place, source);
        float sum = 0.0;
        for (int k = 0; k < 16; ++k) {
            vec2 off = vec2(ivec2(k % 4, k / 4) - place);
            sum += shares_layer(surfaces[k], off, surfaces[own], slope) ? votes[k] : 0.0;
        }
        if (sum > most) {
            most = sum;
            winner = own;
        }
    }
    if (winner < 0 || surfaces[winner].w == 0.0) return vec4(0.0);
    ivec2 place = ivec2(winner % 4, winner / 4);
    vec2 slope = sample_slope(surfaces[winner], first + place, source);
    vec4 sum = vec4(0.0);
    float total = 0.0;
    for (int k = 0; k < 16; ++k) {
        ivec2 pixel = first + ivec2(k % 4, k / 4);
        if (!shares_layer(surfaces[k], vec2(pixel - first - place), surfaces[winner], slope)) continue;
        vec2 off = at - vec2(pixel);
        float weight = gaussian(off, VALUE_REACH);
        float w = 1.0 / surfaces[k].w + dot(sample_slope(surfaces[k], pixel, source), off);
        sum += weight * vec4(surfaces[k].xyz, w);
        total += weight;
    }
    return vec4(normalize(sum.xyz), total / sum.w);
}
