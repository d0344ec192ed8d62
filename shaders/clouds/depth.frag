#version 330 core
// The depth of a splat, pushed back: in a light's view a disc rises over its neighbours by as much.
#include "clouds/hit.glsl"

uniform vec2 first_pixel;  // of the tile of a shadow map
uniform float near;
uniform float push;  // radii

void main() {
    SplatHit hit = hit_splat(gl_FragCoord.xy - 0.5 - first_pixel);
    if (hit.depth == 0.0) discard;
    gl_FragDepth = 1.0 - near / (hit.depth + push * normal_radius.w);
}
