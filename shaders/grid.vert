#version 330 core
// The triangles between the pixels of a frame in the target view, with normals.
#include "squares.glsl"

out vec3 normal;  // source axes

void main() {
    Vertex vertex = find_vertex();
    vec4 surface = texelFetch(surface_map, vertex.pixel, 0);
    place_vertex(vertex, surface.w);
    normal = surface.xyz;
}
