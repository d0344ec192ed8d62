#version 330 core
#ifndef BALLS
#define BALLS 0  // 1: points without a plane, or all of them; 0: discs
#endif
#ifndef QUADS
#define QUADS 0  // 1: four corners of a box for each point, which may be larger than the driver's points
#endif
// A point of a cloud as a GL point: a box round what its disc or ball covers, cut to the picture.
#include "common/cloud_splat.glsl"
#include "common/color.glsl"

uniform vec4 target;
uniform vec2 target_size;
uniform mat4 view;
uniform float scale;   // that the view contains
uniform vec3 radius;   // world units + spacings + pixels
uniform float near;
uniform float share;   // of the radius that is drawn

in vec3 position;
in float spacing;  // or the point's own radius
in vec3 normal;
in vec4 edge;      // direction in which the surface goes on; 0: in all
in vec4 color;     // sRGB

flat out vec3 centre;
flat out vec2 middle;
flat out vec4 normal_radius;
flat out vec3 plane_normal;
flat out vec3 onward;
flat out vec3 linear_color;

const vec4 NOWHERE = vec4(2.0, 2.0, 2.0, 1.0);

void main() {
    gl_Position = NOWHERE;
    gl_PointSize = 1.0;
    centre = (view * vec4(position, 1.0)).xyz;
    float pixel = centre.z / mean_focal_length(target);
    float size = share * (scale * (radius.x + radius.y * spacing) + radius.z * pixel);
    vec3 facing_normal = vec3(0.0);
#if !BALLS
    facing_normal = facing(normalize(mat3(view) * normal), centre);
#endif
    if (!(size > 0.0) || centre.z < max(near, NEAREST_SPLAT * size)) return;
    middle = project(centre, target);
    vec2 extent = max(splat_extent(CloudSplat(centre, facing_normal, size), target), vec2(0.5));
    vec2 low = max(middle - extent, vec2(-0.5));
    vec2 high = min(middle + extent, target_size - 0.5);
    if (low.x > high.x || low.y > high.y) return;
    normal_radius = vec4(facing_normal, size);
    plane_normal = steeper(facing_normal, centre);
    onward = mat3(view) * edge.xyz;
    linear_color = srgb_to_linear(color.rgb);
#if QUADS
    vec2 place = mix(low - 0.0625, high + 0.0625, vec2(gl_VertexID & 1, gl_VertexID >> 1));
#else
    vec2 place = 0.5 * (low + high);
    gl_PointSize = max(high.x - low.x, high.y - low.y) + 0.125;  // GL places points to 1/16 pixel or better
#endif
    gl_Position = vec4((2.0 * place + 1.0) / target_size - 1.0, 0.0, 1.0);  // fragments have depths of their own
}
