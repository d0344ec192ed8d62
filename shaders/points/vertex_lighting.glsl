// The light of a splat, for vertex shaders with LIT 1: their further inputs, and how a pixel of the frame is lit.
#include "common/color.glsl"
#include "common/lights.glsl"
#include "common/resolve.glsl"

uniform sampler2D color_map;  // sRGB, of any size
uniform sampler2D lights;     // these in source axes
uniform vec3 eye;
uniform vec4 material;
uniform vec3 ambient;
uniform int light_count;

flat out vec3 lit;  // sRGB

vec3 light_pixel(ivec2 pixel, vec3 point, vec3 normal, vec2 size) {
    vec3 albedo = srgb_to_linear(picture_at(color_map, vec2(pixel), size));
    vec3 light = light_surface(point, eye, normal, albedo, material, ambient, lights, light_count);
    return linear_to_srgb(min(light, 1.0));
}
