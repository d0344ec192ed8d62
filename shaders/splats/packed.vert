#version 330 core
#ifndef KIND
#define KIND 0  // 0: colours; 1: also normals and depths; 2: depths alone
#endif
// A trained splat as a triangle round its ellipse, from what a page holds of it: see splats_part in page/parts.py.
#include "common/film_planes.glsl"
#include "common/splat_projection.glsl"
#include "common/trained_splats.glsl"

uniform isampler2D order_map;  // the numbers of the splats, the farthest first
uniform sampler2D places;
uniform sampler2D shapes;      // colour, opacity; logarithms of the deviations, normal; rotation; normal, marks, palette
uniform sampler2D palette;     // harmonics above degree 0
uniform vec2 deviations;       // least logarithm, and how far they reach
uniform vec2 bases;            // likewise of colours
uniform int harmonics;         // of each splat: 0, 3, 8 or 15
uniform float shine;           // what they reach
uniform bool is_lit;           // the colours are those of a surface, the same from everywhere
uniform mat4 view;
uniform vec3 eye;
uniform vec4 target;
uniform vec2 target_size;
uniform float near;
uniform float reference;       // depth from which depths count

#if KIND == 1
flat out vec2 dense;  // how many times smaller the splat is as a surface, and its opacity then
#endif
#if KIND > 0
out float peak;
#endif
out vec2 aside;  // deviations from the middle
flat out vec4 color;
flat out vec3 facing;
flat out vec2 reach_depth;

const float DENSER = KIND == 2 ? 2.0 : 2.5;  // as in splat.vert
const int WIDTH = 2048;                   // texels
const int ENTRY = 16, ENTRIES = 64;       // texels of an entry of the palette, entries of a row
const float FAINT = 1.0 / 255.0;
const int ANTIALIASED = 1, SURFACE = 2;  // marks
const vec2 CORNERS[3] = vec2[](vec2(0.0, 2.0), vec2(-1.7320508, -1.0), vec2(1.7320508, -1.0));

vec4 shape_at(int number, int k) {
    int texel = 4 * number + k;
    return texelFetch(shapes, ivec2(texel % WIDTH, texel / WIDTH), 0);
}

void main() {
    int rank = gl_VertexID / 3;
    int number = texelFetch(order_map, ivec2(rank % WIDTH, rank / WIDTH), 0).r;
    vec3 place = texelFetch(places, ivec2(number % WIDTH, number / WIDTH), 0).xyz;
    vec4 shade = shape_at(number, 0), lengths = shape_at(number, 1), last = shape_at(number, 3);
    vec3 seen = (view * vec4(place, 1.0)).xyz;
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    color = vec4(0.0);
    aside = vec2(0.0);
    facing = vec3(0.0);
    reach_depth = vec2(0.0);
#if KIND == 1
    dense = vec2(0.0);
#endif
#if KIND > 0
    peak = 0.0;
#endif
    if (seen.z <= near) return;

    int marks = int(255.0 * last.y + 0.5);
    vec3 scales = exp(deviations.x + deviations.y * lengths.xyz);
    mat3 arms = mat3(view) * quaternion_axes(unpack_rotation(shape_at(number, 2)));
    for (int k = 0; k < 3; ++k) arms[k] *= scales[k];
    mat3 spread = transpose(arms) * picture_ways(seen, target, target_size);
    vec4 ellipse = seen_ellipse(spread, shade.a, (marks & ANTIALIASED) > 0);
    if (ellipse.w < FAINT * (1.0 - 1e-4)) return;

    float denser = density(ellipse.x * ellipse.z, DENSER), opacity = dense_opacity(ellipse.w, denser);
    color.a = KIND == 2 ? opacity : ellipse.w;
    float reach = 2.0 * log(max(255.0 * color.a, 1.0));
    aside = sqrt(reach) * CORNERS[gl_VertexID % 3];
    vec2 offset = vec2(ellipse.x * aside.x, ellipse.y * aside.x + ellipse.z * aside.y);
#if KIND == 1
    dense = vec2(denser, opacity);
#elif KIND == 2
    offset *= inversesqrt(denser);
#endif
    vec2 middle = target.xy * seen.xy / seen.z + target.zw;
    reach_depth = vec2(reach, seen.z - reference);
    gl_Position = vec4((2.0 * (middle + offset) + 1.0) / target_size - 1.0, 0.0, 1.0);

    bool has_surface = is_lit && (marks & SURFACE) > 0;
    color.rgb = bases.x + bases.y * shade.rgb;
    if (harmonics > 0 && !has_surface) {
        ivec2 entry = ivec2(255.0 * last.zw + 0.5);
        int row = entry.x + 256 * entry.y;
        ivec2 first = ivec2(ENTRY * (row % ENTRIES), row / ENTRIES);
        color.rgb += shine_towards(palette, first, harmonics, shine, normalize(place - eye));
    }
    color.rgb = max(color.rgb, 0.0);
#if KIND == 1
    if (has_surface) facing = facing_viewer(mat3(view) * unfolded_normal(vec2(lengths.w, last.x)), seen);
#endif
#if KIND > 0
    peak = reach_depth.y + dot(depth_slope(spread), offset);
#endif
}
