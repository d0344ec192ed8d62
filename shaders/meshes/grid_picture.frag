#version 330 core
#ifndef LOOK_UP
#define LOOK_UP 0
#endif
#ifndef SHADING
#define SHADING 3    // as in grid.frag
#endif
#ifndef LINEAR
#define LINEAR 0     // 1: the picture stays linear, to be averaged with other samples
#endif
#ifndef ALONE
#define ALONE 0      // 1: a single light
#endif
#ifndef CERTAINTY
#define CERTAINTY 0  // 1: some normals are uncertain
#endif
// The mesh between the pixels of a frame -> the picture, lit at once. If a view is lit once, this is faster than grid.frag
// and light.frag, and the same to one step of 255.
#include "common/color.glsl"
#include "common/lights.glsl"
#include "common/picture.glsl"
#include "common/resolve.glsl"
#include "common/toksvig.glsl"
#include "shading/around.glsl"
#include "meshes/visible_grid_point.glsl"

uniform sampler2D color_map;  // sRGB, of any size; where light is interpolated, linear light
uniform sampler2D certainty_map;
uniform sampler2D lights;
uniform vec4 material;
uniform vec3 ambient;
uniform sampler2D visibility_map;
uniform int light_count;
uniform mat4 only_light;  // its row of `lights`

out vec4 color;

void main() {
    GridSeen seen = find_seen();
    vec2 size = vec2(textureSize(surface_map, 0)), at = grid_color_position(seen);
    vec3 light;
    if (SHADING == 2) light = grid_light(color_map, seen);
    else light = srgb_to_linear(picture_at(color_map, at, size));
    if (SHADING == 3) {
        vec3 normal = mat3(view) * grid_normal(surface_map, seen), eye = vec3(0.0);
        vec3 point = pixel_ray(gl_FragCoord.xy - 0.5, target) / seen.inverse_depth;
        vec4 own = material;
        if (CERTAINTY == 1) own = widened(material, certainty_at(certainty_map, at, size));
        vec4 around = vec4(0.0);
        if (VISIBILITY == 1) around = carried_visibility(visibility_map, at, size, mat3(view));
        else if (ENVIRONMENT > 0) around = around_at(around, normal);
        vec3 everywhere = VISIBILITY == 1 ? ambient * around.w : ambient, albedo = light;
        if (ALONE == 1) light = light_surface_alone(point, eye, normal, albedo, own, everywhere, only_light);
        else light = light_surface(point, eye, normal, albedo, own, everywhere, lights, light_count);
        if (ENVIRONMENT > 0) light += light_from_around(around, normalize(-point), normal, albedo, own, 0.0);
    }
    color = vec4(LINEAR == 1 ? light : linear_to_srgb(light), 1.0);
}
