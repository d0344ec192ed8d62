#version 330 core
// The surface of a frame, or what its points see -> a small copy, for the search of its exposure.

uniform sampler2D copied_map;
uniform vec2 cells;             // texels of the copy

out vec4 surface;

void main() {
    ivec2 size = textureSize(copied_map, 0);
    surface = texelFetch(copied_map, min(ivec2(gl_FragCoord.xy / cells * vec2(size)), size - 1), 0);
}
