#version 330 core
#ifndef SAME_SIZE
#define SAME_SIZE 1  // 0: the picture is larger or smaller than the surface
#endif
#ifndef COMPLETED
#define COMPLETED 1  // 0: no pixel got a surface that was not measured
#endif
// Photograph and certainty of normals -> what calm_normals.glsl knows of each pixel beside its surface.
#include "common/calm_normals.glsl"
#include "common/picture.glsl"

uniform sampler2D surface_map;
uniform sampler2D measured_map;   // before missing points were completed, of any size
uniform sampler2D certainty_map;
uniform sampler2D color_map;

out vec4 witness;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 size = vec2(textureSize(surface_map, 0));
    vec3 color = SAME_SIZE == 1 ? texel_at(color_map, pixel).rgb : picture_at(color_map, vec2(pixel), size);
    vec2 at = gl_FragCoord.xy / size;
    bool is_measured = true;
#if COMPLETED == 1
    is_measured = texel_at(measured_map, ivec2(at * vec2(textureSize(measured_map, 0)))).w != 0.0;
#endif
    float certainty = certainty_at(certainty_map, vec2(pixel), size);
    witness = witness_of(color, certainty, is_measured);
}
