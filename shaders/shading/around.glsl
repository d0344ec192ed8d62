#ifndef VISIBILITY
#define VISIBILITY 0   // 1: what is near hides a part of the light from all around
#endif
#ifndef ENVIRONMENT
#define ENVIRONMENT 0  // 1: an environment, in place of ambient light; 2: which is seen in highlights, too
#endif
// The light from all around, for shaders that light surfaces: the inputs, and what a surface sends back of it.
#include "common/surroundings.glsl"

uniform mat3 first_bands;  // of the environment, in the axes of the surfaces
uniform mat3 second_bands;
uniform mat3 third_bands;
uniform sampler2D lobe_map;
uniform mat3 to_sky;       // from the axes of the surfaces to those of the environment
uniform float lobe_gain;   // factor on the maps
uniform float lobes;       // how many maps there are, one above the other

// visibility: as in surroundings.glsl, with the share -1 where it is not known; lobe: the number of the material's map
vec4 around_at(vec4 visibility, vec3 n) {
    return VISIBILITY == 1 && visibility.w >= 0.0 ? visibility : vec4(OPEN * n, 1.0);
}

vec3 light_from_around(vec4 visibility, vec3 v, vec3 n, vec3 albedo, vec4 material, float lobe) {
    vec3 light = vec3(0.0);
    if (ENVIRONMENT > 0) {
        light = material.y * albedo * environment_light(visibility, first_bands, second_bands, third_bands);
    }
    if (ENVIRONMENT == 2) {
        vec3 mirrored = 2.0 * dot(n, v) * n - v;
        float strength = highlight_strength(material) * highlight_visibility(visibility, mirrored, material.w);
        light += lobe_gain * strength * texture_of_lobes(lobe_map, to_sky * mirrored, lobe, lobes);
    }
    return light;
}
