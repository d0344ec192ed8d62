#version 330 core
// The triangles between the pixels of a frame, whose light is known at the pixels.
#include "squares.glsl"

uniform sampler2D light_map;  // linear

out vec3 light;

void main() {
    Vertex vertex = find_vertex();
    place_vertex(vertex, texelFetch(surface_map, vertex.pixel, 0).w);
    light = texelFetch(light_map, vertex.pixel, 0).rgb;
}
