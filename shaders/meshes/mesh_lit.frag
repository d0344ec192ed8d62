#version 330 core
// A mesh whose corners are already lit. Normal 0 says so to the light pass.
#include "common/color.glsl"

uniform sampler2D picture;  // sRGB
uniform vec3 base_color;    // linear
uniform float material_number;

in vec3 diffuse;
in vec3 specular;
in vec2 texture_uv;
in vec3 corner_tint;
in float depth;

layout(location = 0) out vec4 surface;
layout(location = 1) out vec4 albedo;
layout(location = 2) out vec4 visibility;  // share -1: not known

void main() {
    visibility = vec4(0.0, 0.0, 0.0, -1.0);
    surface = vec4(0.0, 0.0, 0.0, depth);
    vec3 color = base_color * (1.0 + corner_tint) * srgb_to_linear(texture(picture, texture_uv).rgb);
    albedo = vec4(color * diffuse + specular, material_number);
}
