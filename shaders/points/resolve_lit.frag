#version 330 core
#ifndef LOOK_UP
#define LOOK_UP 0
#endif
#ifndef LINEAR
#define LINEAR 0  // 1: the picture stays linear, to be averaged with other samples
#endif
#ifndef ALONE
#define ALONE 0      // 1: a single light
#endif
#ifndef CALM
#define CALM 0  // 1: normals for light are not those of the surface
#endif
#ifndef CERTAINTY
#define CERTAINTY 0  // 1: some normals are uncertain
#endif
#ifndef SAME_SIZE
#define SAME_SIZE 0  // 1: the picture has a pixel for each of the frame
#endif
// What each pixel of the view shows -> the picture, lit at once (phong). If a view is lit once, this is faster
// than resolve_surfaces.frag and light.frag, and the same to the last bit: it computes what they do.
#include "common/color.glsl"
#include "common/lights.glsl"
#include "common/toksvig.glsl"
#include "shading/around.glsl"
#include "points/visible_point.glsl"

uniform sampler2D color_map;  // sRGB, of any size
uniform sampler2D certainty_map;
uniform sampler2D light_normals;
uniform sampler2D lights;
uniform vec4 material;
uniform vec3 ambient;
uniform sampler2D visibility_map;
uniform int light_count;
uniform mat4 only_light;  // its row of `lights`

out vec4 color;

void main() {
    Seen seen = find_seen();
    vec4 weight = seen_weights(seen, source);
    vec3 normal = mat3(view) * (CALM == 1 ? normalize(mix_light(seen, weight, light_normals)) : mix_normal(seen, weight));
    vec2 size = vec2(textureSize(surface_map, 0));
    vec2 at = color_position(seen, weight);
    vec3 encoded = SAME_SIZE == 1 ? mix_color(seen, weight, color_map) : picture_at(color_map, at, size);
    vec3 albedo = srgb_to_linear(encoded);
    vec3 point = pixel_ray(gl_FragCoord.xy - 0.5, target) * (1.0 / seen.inverse_depth);
    vec4 own = material;
    if (CERTAINTY == 1) {
        normal *= certainty_at(certainty_map, seen.at, size);
        float certainty = length(normal);
        own = widened(own, min(certainty, 1.0));
        if (certainty > 0.0) normal /= certainty;
    }
    vec4 around = vec4(0.0);
    if (VISIBILITY == 1) around = carried_visibility(visibility_map, at, size, mat3(view));
    else if (ENVIRONMENT > 0) around = around_at(around, normal);
    vec3 everywhere = VISIBILITY == 1 ? ambient * around.w : ambient;
    vec3 light;
    if (ALONE == 1) light = light_surface_alone(point, vec3(0.0), normal, albedo, own, everywhere, only_light);
    else light = light_surface(point, vec3(0.0), normal, albedo, own, everywhere, lights, light_count);
    if (ENVIRONMENT > 0) light += light_from_around(around, normalize(-point), normal, albedo, own, 0.0);
    color = vec4(LINEAR == 1 ? light : linear_to_srgb(min(light, 1.0)), 1.0);
    if (!is_seen) color = vec4(0.0);
}
