#version 330 core
// The triangles between the pixels of a frame, with what is lit once for all of a triangle.
#include "squares.glsl"

flat out vec3 middle;  // source axes
flat out vec3 facet;   // unit normal, towards the frame's camera

vec3 point_at(ivec2 pixel) {
    return pixel_ray(vec2(pixel), source) * abs(texelFetch(surface_map, pixel, 0).w);
}

void main() {
    Vertex vertex = find_vertex();
    place_vertex(vertex, texelFetch(surface_map, vertex.pixel, 0).w);
    // Vertices 0 and 2 speak for the first triangle, 1 and 3 for the second: one is the first of its triangle's vertices and
    // one the last, of which GL takes either.
    bool is_second = (vertex.number & 1) == 1;
    vec3 p = point_at(vertex.square + vertex_corner(vertex.triangles, is_second ? 3 : 0));
    vec3 q = point_at(vertex.square + vertex_corner(vertex.triangles, is_second ? 2 : 1));
    vec3 r = point_at(vertex.square + vertex_corner(vertex.triangles, is_second ? 1 : 2));
    middle = (p + q + r) / 3.0;
    facet = triangle_normal(p, q, r);
}
