#version 330 core
#ifndef KIND
#define KIND 0    // 0: colours; 1: also normals and depths; 2: depths alone
#endif
#ifndef HIDDEN
#define HIDDEN 0  // 1: other objects may stand before it
#endif
// What a trained splat adds to a pixel: all is multiplied by its alpha, which hides what is there.
#include "common/trained_splats.glsl"

in vec2 aside;
flat in vec4 color;
flat in vec3 facing;
flat in vec2 reach_depth;
#if KIND > 0
in float peak;
#endif
#if KIND == 1
flat in vec2 dense;
const float ALONE = 0.02;  // of what it covers: so much of its surface is seen where no other one is
#endif
#if HIDDEN
uniform sampler2D opaque_map;  // surfaces of other objects: depth in w, 0 is none
uniform float reference;
#endif

#if KIND < 2
layout(location = 0) out vec4 colors;
#endif
#if KIND == 1
layout(location = 1) out vec4 normals;
layout(location = 2) out vec4 depths;
#elif KIND == 2
layout(location = 0) out vec4 depths;
#endif

void main() {
    float square = dot(aside, aside);
    if (square > reach_depth.x) discard;
#if HIDDEN
    float before = abs(texelFetch(opaque_map, ivec2(gl_FragCoord.xy), 0).w);
    if (before > 0.0 && reach_depth.y + reference >= before) discard;
#endif
    float alpha = splat_alpha(color.a, square);
#if KIND < 2
    colors = vec4(color.rgb * alpha, alpha);
#endif
#if KIND == 1
    alpha = max(splat_alpha(dense.y, dense.x * square), ALONE * alpha);
    normals = vec4(facing * alpha, alpha);
#endif
#if KIND > 0
    depths = vec4(peak, peak * peak, peak * peak * peak, 1.0) * alpha;
#endif
}
