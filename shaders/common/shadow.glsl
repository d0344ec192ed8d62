#include "common/camera.glsl"
#include "common/texels.glsl"

#ifndef SHADOWS
#define SHADOWS 1  // 2: some lights are larger than points
#endif
#ifndef SPLATS
#define SPLATS 0   // 1: trained splats cast shadows, too
#endif
#if SPLATS
#include "common/trained_splats.glsl"
uniform sampler2D splat_map;  // tiles as in the shadow map: see shaders/splats/shadow.frag
uniform float splat_thickness;
#endif

// Shadows: a light's views of the scene lie as tiles in one depth picture, 1 - near/z; here they are asked whether
// anything nearer to the light stands before a point. One row of `views` a view:
// texels 0 to 2  rows of the matrix that takes the lit point's axes to those of the light's camera
// texel 3        focal length, centre (the same in x and y), tile's first column and row; pixels
// texel 4        near; pixels a side; contact: by how much an occluder must stand out of the surface; spread: by how many
//                pixels a shadow blurs for each unit of 1/z from the occluder to the point, 0 of a light that is a point
// texel 5        with (x, y, z, 1) of the point: how much farther it is from the sensor than where contact is that

const float FLATTEST = 0.1;   // cosine: a receiver seen flatter by the light is taken to be tilted no more
const float SHARP = 3.0;       // pixels: what blurs by less is compared with its neighbours alone, as of a point light,
const float BLURRED = 1.125;   // and what blurs by more is looked for all round; between them both, so that few gaps open
const float GRAZING = 0.5;     // cosine: where light comes flatter, a surface of splats looks no thicker to it
const float PUSH = 0.25;       // thicknesses of splats by which a point rises from its surface before it is looked up
const float MOST_BLUR = 48.0;  // pixels: shadows blur by no more in one view

const int SPREAD_TAPS = 16;   // places spread evenly over a disc, each a golden angle farther round (Vogel 1979)
const mat2 ONWARDS = mat2(-0.73736888, 0.67549029, -0.67549029, -0.73736888);

// 1/z of the picture at a pixel of a tile; 0 where nothing is, and -1 outside the tile.
float occluder_at(sampler2D shadow_map, vec2 pixel, vec4 tile, vec4 range) {
    if (any(lessThan(pixel, vec2(0.0))) || any(greaterThan(pixel, vec2(range.y - 1.0)))) return -1.0;
    return (1.0 - texel_at(shadow_map, ivec2(pixel + tile.zw)).r) / range.x;
}

// Weights of the three pixels round a position (quadratic B-spline); offset is -0.5 to 0.5 from the middle one.
vec3 tent(float offset) {
    float before = 0.5 - offset;
    float after = 0.5 + offset;
    return vec3(0.5 * before * before, 0.75 - offset * offset, 0.5 * after * after);
}

// Whether an occluder stands out of a surface; both are 1/z. away: cosine between the surface's normal and the ray.
bool stands_out(float occluder, float own, float away, float contact) {
    return (occluder - own) * away > contact * own * occluder;
}

// By how many pixels the shadow blurs of what stands out at a pixel of a tile: 0 where nothing does, -1 outside the tile.
float blur_at(sampler2D shadow_map, vec4 tile, vec4 range, vec2 pixel, vec2 at, vec3 surface, float away) {
    float own = max(surface.x + dot(surface.yz, pixel - at), 0.0);
    float occluder = occluder_at(shadow_map, pixel, tile, range);
    if (occluder < 0.0) return -1.0;
    return stands_out(occluder, own, away, range.z) ? range.w * (occluder - own) : 0.0;
}

// Share of a light that reaches a point past what blurs: that of the open pixels within the mean blur of the occluders
// (percentage closer soft shadows: Fernando 2005). surface: 1/z of the point, and how it slopes. widest: pixels within
// which occluders are looked for
float soft_share(sampler2D shadow_map, vec4 tile, vec4 range, vec2 at, vec3 surface, float away, float widest) {
    int taps = widest < BLURRED ? 0 : SPREAD_TAPS;
    float found = 0.0, blurs = 0.0, seen = 0.0, open = 0.0;
    vec2 way = vec2(1.0, 0.0);
    for (int k = 0; k < taps; ++k) {
        vec2 aside = widest * (float(k) + 0.5) / float(SPREAD_TAPS) * way;  // closer to each other in the middle
        float blur = blur_at(shadow_map, tile, range, floor(at + aside + 0.5), at, surface, away);
        found += blur < max(BLURRED, length(aside)) ? 0.0 : 1.0;
        blurs += blur < max(BLURRED, length(aside)) ? 0.0 : blur;
        way = ONWARDS * way;
    }
    float reach = min(blurs / max(found, 1.0), widest);
    taps = found > 0.0 ? taps : 0;
    way = vec2(1.0, 0.0);
    for (int k = 0; k < taps; ++k) {
        vec2 aside = reach * sqrt((float(k) + 0.5) / float(SPREAD_TAPS)) * way;
        float blur = blur_at(shadow_map, tile, range, floor(at + aside + 0.5), at, surface, away);
        seen += blur < 0.0 ? 0.0 : 1.0;  // another view of the light may show what is outside
        open += blur < 0.0 || blur > BLURRED ? 0.0 : 1.0;
        way = ONWARDS * way;
    }
    return seen > 0.0 ? open / seen : 1.0;
}

#if SPLATS
// Share of a light that splats leave of it at a place of a tile, between four pixels; outside the tile all.
float share_beside_splats(sampler2D seen_map, vec4 tile, float side, vec2 at, float depth, float thickness) {
    vec2 low = floor(at), between = at - low;
    float share = 0.0;
    for (int y = 0; y < 2; ++y) {
        for (int x = 0; x < 2; ++x) {
            vec2 pixel = low + vec2(x, y);
            bool inside = all(greaterThanEqual(pixel, vec2(0.0))) && all(lessThanEqual(pixel, vec2(side - 1.0)));
            float own = 1.0;
            if (inside) own = share_past_splats(texelFetch(seen_map, ivec2(pixel + tile.zw), 0), depth, thickness);
            share += own * (x == 0 ? 1.0 - between.x : between.x) * (y == 0 ? 1.0 - between.y : between.y);
        }
    }
    return share;
}
#endif

// Share of a light's view `row` that reaches the point: 1 in the light, 0 in full shadow, between at a soft edge. The
// occluders are compared with the receiver's own tangent plane at their place, so that a slanted surface does not shade
// itself (receiver plane depth bias: Isidoro 2006). Those whose shadow is sharp are looked for apart from those that blur.
float light_share(sampler2D shadow_map, sampler2D views, int row, vec3 point, vec3 n) {
    mat3 turn = transpose(mat3(
        texelFetch(views, ivec2(0, row), 0).xyz,
        texelFetch(views, ivec2(1, row), 0).xyz,
        texelFetch(views, ivec2(2, row), 0).xyz
    ));
    vec3 shift = vec3(
        texelFetch(views, ivec2(0, row), 0).w, texelFetch(views, ivec2(1, row), 0).w, texelFetch(views, ivec2(2, row), 0).w
    );
    vec4 tile = texelFetch(views, ivec2(3, row), 0);
    vec4 range = texelFetch(views, ivec2(4, row), 0);
    vec3 seen = turn * point + shift;
    if (seen.z <= range.x) return 1.0;
    float farther = dot(texelFetch(views, ivec2(5, row), 0), vec4(point, 1.0));
    range.z *= max(1.0, farther * farther);  // noise grows with the square of the distance, where cameras triangulate
    vec4 intrinsics = vec4(tile.xx, tile.yy);
    vec2 at = project(seen, intrinsics);
    vec3 normal = turn * n;
    vec3 ray = seen / seen.z;
    float cosine = dot(normal, ray), away = abs(cosine);
    cosine = sign(cosine) * max(abs(cosine), FLATTEST * length(ray));
    vec2 slope = cosine == 0.0 ? vec2(0.0) : normal.xy / (intrinsics.xy * (cosine * seen.z));
    vec2 middle = floor(at + 0.5);
    vec3 across = tent(at.x - middle.x);
    vec3 down = tent(at.y - middle.y);
    float share = 0.0;
    for (int y = 0; y < 3; ++y) {
        for (int x = 0; x < 3; ++x) {
            vec2 pixel = middle + vec2(x - 1, y - 1);
            float own = max(1.0 / seen.z + dot(slope, pixel - at), 0.0);
            float occluder = occluder_at(shadow_map, pixel, tile, range);
            bool hides = stands_out(occluder, own, away, range.z);
#if SHADOWS == 2
            hides = hides && range.w * (occluder - own) < SHARP;
#endif
            share += hides ? 0.0 : across[x] * down[y];
        }
    }
#if SHADOWS == 2
    float widest = min(range.w * (1.0 / range.x - 1.0 / seen.z), MOST_BLUR);
    widest = share > 0.0 ? widest : 0.0;
    share *= soft_share(shadow_map, tile, range, at, vec3(1.0 / seen.z, slope), away, widest);
#endif
#if SPLATS
    vec3 raised = seen + PUSH * splat_thickness * normal;
    float slanted = splat_thickness / max(away / length(ray), GRAZING);
    share *= share_beside_splats(splat_map, tile, range.y, project(raised, intrinsics), raised.z, slanted);
#endif
    return share;
}

// Which of the six views of a point light a direction from it falls into: +x, -x, +y, -y, +z, -z.
int cube_face(vec3 direction) {
    vec3 size = abs(direction);
    if (size.x >= size.y && size.x >= size.z) return direction.x > 0.0 ? 0 : 1;
    if (size.y >= size.z) return direction.y > 0.0 ? 2 : 3;
    return direction.z > 0.0 ? 4 : 5;
}
