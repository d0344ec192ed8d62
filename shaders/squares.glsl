// Shared by the vertex shaders of a frame's triangles: their inputs, and where a vertex is. Each square of four pixels has
// four vertices, found from gl_VertexID.
#include "common/grid.glsl"

uniform sampler2D surface_map;   // of the frame: unit normal, depth, whose sign does not count
uniform sampler2D triangle_map;  // which of the triangles there are, over 255
uniform ivec3 window;            // of squares: first column and row, columns
uniform int first_square;        // of those that are drawn
uniform vec4 source;
uniform mat4 view;
uniform vec4 target;
uniform vec2 target_size;
uniform float near;

out vec3 point;           // source axes
flat out float is_whole;  // 1: the square has both triangles

const vec4 NOWHERE = vec4(2.0, 2.0, 2.0, 1.0);

struct Vertex {
    ivec2 square;
    int triangles;
    int number;   // 0 to 3
    ivec2 pixel;
};

Vertex find_vertex() {
    int number = gl_VertexID & 3;
    ivec2 square = window.xy + pixel_of(first_square + (gl_VertexID >> 2), window.z);
    int triangles = int(texelFetch(triangle_map, square, 0).r * 255.0 + 0.5);
    return Vertex(square, triangles, number, square + vertex_corner(triangles, number));
}

// What the vertex hands on, but for its light. Depth is 1 - near/z, linear in 1/z, as for splats.
void place_vertex(Vertex vertex, float depth) {
    point = pixel_ray(vec2(vertex.pixel), source) * abs(depth);
    is_whole = (vertex.triangles & (FIRST + SECOND)) == FIRST + SECOND ? 1.0 : 0.0;
    vec3 seen = mat3(view) * point + view[3].xyz;
    // Pixel centres are at integers: (u + 0.5) / width of the way across. Homogeneous, for points behind the viewer.
    vec2 place = target.xy * seen.xy + (target.zw + 0.5) * seen.z;
    bool exists = vertex.triangles != 0;
    gl_Position = exists ? vec4(2.0 * place / target_size - seen.z, seen.z - 2.0 * near, seen.z) : NOWHERE;
}
