#version 330 core
// The surface of a frame -> a small copy, for the search of its exposure.

uniform sampler2D surface_map;  // unit normal, depth
uniform vec2 cells;             // texels of the copy

out vec4 surface;

void main() {
    ivec2 size = textureSize(surface_map, 0);
    surface = texelFetch(surface_map, min(ivec2(gl_FragCoord.xy / cells * vec2(size)), size - 1), 0);
}
