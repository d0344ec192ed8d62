#version 330 core
// A mesh as a surface for the light pass: unit normal towards the viewer, depth, linear albedo, number of its material.
#include "common/color.glsl"

uniform sampler2D picture;  // sRGB
uniform vec3 base_color;    // linear
uniform float material_number;
uniform vec4 target;
uniform bool is_lit;        // false shows the albedo as it is

in vec3 target_normal;
in vec2 texture_uv;
in vec3 corner_tint;
in float depth;

layout(location = 0) out vec4 surface;
layout(location = 1) out vec4 albedo;
layout(location = 2) out vec4 visibility;  // share -1: not known

void main() {
    vec3 n = normalize(target_normal);
    vec3 ray = vec3((gl_FragCoord.xy - 0.5 - target.zw) / target.xy, 1.0);
    if (dot(n, ray) > 0.0) n = -n;
    visibility = vec4(0.0, 0.0, 0.0, -1.0);
    surface = vec4(is_lit ? n : vec3(0.0), depth);
    albedo = vec4(base_color * (1.0 + corner_tint) * srgb_to_linear(texture(picture, texture_uv).rgb), material_number);
}
