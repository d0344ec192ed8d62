#version 330 core
// The depth of a mesh that was drawn in a light's view -> a tile of the shadow map.
uniform sampler2D window_depths;  // 1 - near/z
uniform ivec2 first;              // pixel of the tile

void main() {
    gl_FragDepth = texelFetch(window_depths, ivec2(gl_FragCoord.xy) - first, 0).r;
}
