#version 330 core
#ifndef KIND
#define KIND 0  // 0: colours; 1: also normals and depths; 2: depths alone
#endif
// A trained splat as a triangle round its ellipse; rows come the farthest first.
#include "common/trained_splats.glsl"

uniform vec2 target_size;

in vec2 middle;
in vec3 arms;     // l11, l21, l22
in float depth;   // from the reference
in vec4 shade;    // sRGB and opacity
#if KIND == 1
in vec3 normal;
flat out vec2 dense;  // how many times smaller the splat is as a surface, and its opacity then
#endif
#if KIND > 0
in vec2 slope;    // of the depth where it is densest
out float peak;
#endif

out vec2 aside;   // deviations from the middle
flat out vec4 color;
flat out vec3 facing;
flat out vec2 reach_depth;

const float DENSER = KIND == 2 ? 2.0 : 2.5;  // times, as a surface; in a light's view, too much lets light through
const vec2 CORNERS[3] = vec2[](vec2(0.0, 2.0), vec2(-1.7320508, -1.0), vec2(1.7320508, -1.0));

void main() {
    color = shade;
    float denser = density(arms.x * arms.z, DENSER), opacity = dense_opacity(shade.a, denser);
#if KIND == 2
    color.a = opacity;
#endif
    float reach = 2.0 * log(max(255.0 * color.a, 1.0));
    aside = sqrt(reach) * CORNERS[gl_VertexID];
    vec2 offset = vec2(arms.x * aside.x, arms.y * aside.x + arms.z * aside.y);
#if KIND == 1
    dense = vec2(denser, opacity);
#elif KIND == 2
    offset *= inversesqrt(denser);
#endif
    reach_depth = vec2(reach, depth);
    facing = vec3(0.0);
#if KIND == 1
    facing = normal;
#endif
#if KIND > 0
    peak = depth + dot(slope, offset);
#endif
    gl_Position = vec4((2.0 * (middle + offset) + 1.0) / target_size - 1.0, 0.0, 1.0);
}
