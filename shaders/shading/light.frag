#version 330 core
// One program for each use: software drivers run both sides of every branch that the compiler cannot decide.
#ifndef POINTS
#define POINTS 0     // 1: the points of a frame, whose light is shown flat or interpolated later; 0: pixels of a view
#endif
#ifndef SHADOWS
#define SHADOWS 0    // 1: lights may be spots and cast shadows; 2: some are larger than points
#endif
#ifndef MATERIALS
#define MATERIALS 0  // 1: a material for each number in the albedo's alpha
#endif
#ifndef LINEAR
#define LINEAR 0     // 1: the pixels stay linear, to be averaged with other samples
#endif
#ifndef ALONE
#define ALONE 0      // 1: a single light, without SHADOWS
#endif
#ifndef CERTAINTY
#define CERTAINTY 0  // 1: some normals are uncertain: those of pixels are shorter, points have a map
#endif
#ifndef EDL
#define EDL 0        // 1: what has a negative material number keeps its colours, darker beside what is nearer
#endif
#ifndef TONE
#define TONE 0       // 1: light above white rolls off; only where pixels do not stay linear
#endif
#ifndef SPLIT
#define SPLIT 0      // 1: what a white matt surface sends back, in alpha the sign of its depth; and highlights
#endif
// Lights every texel in a picture of surfaces. Deferred shading: Deering et al. 1988.
#include "common/camera.glsl"
#include "common/color.glsl"
#include "common/eye_dome.glsl"
#include "common/lights.glsl"
#include "common/picture.glsl"
#include "common/shadowed_lights.glsl"
#include "common/texels.glsl"
#include "common/tone.glsl"
#include "common/toksvig.glsl"
#include "shading/around.glsl"

uniform sampler2D surface_map;  // normal, depth (0: nothing); normal 0: already lit
uniform sampler2D certainty_map;
uniform sampler2D albedo_map;   // of pixels, linear; in alpha the number of the material
uniform sampler2D color_map;    // of points: sRGB, of any size
uniform vec4 intrinsics;
uniform vec3 eye;    // in the axes of the surfaces, like the lights
uniform float scale; // of the points' object
uniform sampler2D materials;  // one per row
uniform vec4 material;
uniform sampler2D lights;
uniform vec3 ambient;
uniform sampler2D visibility_map;
uniform int light_count;
uniform mat4 only_light;  // its row of `lights`
uniform sampler2D shadow_map;
uniform sampler2D views;
uniform mat3 to_world;

layout(location = 0) out vec4 color;
#if SPLIT
layout(location = 1) out vec4 shine;
#endif

vec3 sent_back(vec3 point, vec3 normal, vec3 albedo, vec4 own, vec4 around, float lobe) {
    vec3 everywhere = VISIBILITY == 1 ? ambient * around.w : ambient;
    vec3 lit;
    if (SHADOWS > 0) {
        lit = light_surface_shadowed(
            point, eye, normal, albedo, own, everywhere, lights, light_count, shadow_map, views, to_world
        );
    } else if (ALONE == 1) {
        lit = light_surface_alone(point, eye, normal, albedo, own, everywhere, only_light);
    } else {
        lit = light_surface(point, eye, normal, albedo, own, everywhere, lights, light_count);
    }
    if (ENVIRONMENT > 0) lit += light_from_around(around, normalize(eye - point), normal, albedo, own, lobe);
    return lit;
}

void main() {
    vec4 surface = texel_at(surface_map, ivec2(gl_FragCoord.xy));
    if (surface.w == 0.0) discard;
    vec2 pixel = gl_FragCoord.xy - 0.5;
    vec3 point = pixel_ray(pixel, intrinsics) * abs(surface.w);
    if (POINTS == 1) point *= scale;

    vec4 albedo = vec4(0.0);
    if (POINTS == 0) albedo = texel_at(albedo_map, ivec2(pixel));
    if (POINTS == 1) albedo.rgb = srgb_to_linear(picture_at(color_map, pixel, vec2(textureSize(surface_map, 0))));
    vec4 own = material;
    float lobe = 0.0;
    if (MATERIALS == 1) {
        int row = int(abs(albedo.a) + 0.5) - 1;
        own = texelFetch(materials, ivec2(0, row), 0);
        if (ENVIRONMENT == 2) lobe = texelFetch(materials, ivec2(1, row), 0).x;
    }

    vec3 normal = surface.xyz;
    if (CERTAINTY == 1) {
        vec2 size = vec2(textureSize(surface_map, 0));
        float certainty = POINTS == 1 ? certainty_at(certainty_map, pixel, size) : length(normal);
        own = widened(own, min(certainty, 1.0));
        if (POINTS == 0 && certainty > 0.0) normal /= certainty;
    }
    vec4 around = vec4(0.0);
    if (VISIBILITY == 1) {
        vec4 seen = texelFetch(visibility_map, ivec2(pixel), 0);
        around = around_at(POINTS == 1 ? unpack_visibility(seen) : seen, normal);
    } else if (ENVIRONMENT > 0) {
        around = around_at(around, normal);
    }
#if SPLIT
    shine = vec4(sent_back(point, normal, vec3(0.0), own, around, lobe), 1.0);
    color = vec4(sent_back(point, normal, vec3(1.0), own, around, lobe) - shine.rgb, sign(surface.w));
#else
    vec3 lit = sent_back(point, normal, albedo.rgb, own, around, lobe);
    if (POINTS == 0 && surface.xyz == vec3(0.0)) lit = albedo.rgb;
    if (EDL == 1 && albedo.a < 0.0) lit *= eye_dome(surface_map, ivec2(pixel), surface.w);
    if (TONE == 1) lit = neutral_tone(lit);
    color = vec4(POINTS + LINEAR > 0 ? lit : linear_to_srgb(min(lit, 1.0)), 1.0);
#endif
}
