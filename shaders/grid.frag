#version 330 core
#ifndef CERTAINTY
#define CERTAINTY 0  // 1: some normals are uncertain
#endif
// The triangles between the pixels of a frame -> what the light pass reads. Normals are interpolated; colours are looked
// up in the picture, where the frame's camera saw the point.
#include "common/color.glsl"
#include "common/grid.glsl"
#include "common/picture.glsl"
#include "common/toksvig.glsl"

uniform sampler2D color_map;  // sRGB, of any size
uniform sampler2D certainty_map;
uniform vec2 source_size;
uniform vec4 source;
uniform mat4 view;
uniform float scale;          // of the object; the view does not contain it
uniform float material_number;
uniform bool is_lit;          // false shows the colours as they are: normal 0

in vec3 point;
in vec3 normal;
flat in float is_whole;

layout(location = 0) out vec4 surface;
layout(location = 1) out vec4 albedo;

void main() {
    vec3 seen = mat3(view) * point + view[3].xyz;
    surface = vec4(is_lit ? mat3(view) * normalize(normal) : vec3(0.0), scale * seen.z);
    vec2 at = triangle_position(project(point, source), is_whole > 0.5);
    if (CERTAINTY == 1) surface.xyz *= certainty_at(certainty_map, at, source_size);
    albedo = vec4(srgb_to_linear(picture_at(color_map, at, source_size)), material_number);
}
