#include "common/camera.glsl"
#include "common/inverse_depth.glsl"

// Normals from the triangles around a pixel: the mean of the cross products of edges to consecutive
// neighbours, as for vertices of a mesh (Gouraud 1971) and, on depth pictures, in the work that this project
// is based on (ETH Zurich 2001, equation 3.2 and figure 5.4).
// Triangle k lies between neighbours k and k+1 of the ring E, SE, S, SW, W, NW, N, NE. They are used in
// the order 0 4 2 6 1 5 3 7: always spread around the pixel, and the first four touch all eight neighbours.

const ivec2 RING[8] = ivec2[8](ivec2(1, 0), ivec2(1, 1), ivec2(0, 1), ivec2(-1, 1),
                               ivec2(-1, 0), ivec2(-1, -1), ivec2(0, -1), ivec2(1, -1));
const int TRIANGLE_ORDER[8] = int[8](0, 4, 2, 6, 1, 5, 3, 7);

// The first `count` triangles (1, 2, 4 or 8) of that order that exist. A neighbour farther off in z
// than max_step.x + max_step.y * z is left out, with both of its triangles. (0, 0, 0) without depth; facing the camera
// if no triangle is left.
vec3 normal_from_triangles(sampler2D depth_map, ivec2 pixel, vec4 intrinsics, int count, vec2 max_step) {
    float z = depth_at(depth_map, pixel, ivec2(0));
    if (z == 0.0) return vec3(0.0);
    vec3 ray = pixel_ray(vec2(pixel), intrinsics);
    float limit = max_step.x + max_step.y * z;
    vec3 edge[8];
    bool usable[8];
    for (int k = 0; k < 8; ++k) {
        float z_k = depth_at(depth_map, pixel, RING[k]);
        usable[k] = z_k > 0.0 && abs(z_k - z) <= limit;
        edge[k] = pixel_ray(vec2(pixel + RING[k]), intrinsics) * (z_k / z) - ray;  // divided by z: no unit can overflow
    }
    vec3 sum = vec3(0.0);
    for (int i = 0, taken = 0; i < 8 && taken < count; ++i) {
        int k = TRIANGLE_ORDER[i];
        int next = (k + 1) & 7;
        if (usable[k] && usable[next]) {
            sum += cross(edge[k], edge[next]);
            ++taken;
        }
    }
    float size = length(sum);
    if (!(size > 0.0)) return -normalize(ray);
    return sum / (dot(sum, ray) > 0.0 ? -size : size);
}
