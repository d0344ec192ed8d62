#include "common/phong.glsl"

// Light from all around: ambient light, or an environment. A point sees a part of it: its visibility holds the bent normal,
// which is the mean of the directions that it sees, weighted by the cosine to its normal, and as long as these agree, and
// in w the share that it sees of all that could reach it. See visibility.glsl for how these are found.

const float NARROWEST = 0.8;   // mean cosine of the narrowest lobe that harmonics of order 2 show without ripples
const float LEAST = 0.3;       // of the mean radiance: harmonics of order 2 go below, and below 0
const float OPEN = 2.0 / 3.0;  // length of the bent normal where nothing is hidden: it is the normal's mean cosine

// Visibility in the 8 bits of a texel, and back: dark shares are finer.
vec4 pack_visibility(vec4 visibility) {
    return vec4(0.5 + 0.5 * visibility.xyz, sqrt(visibility.w));
}

vec4 unpack_visibility(vec4 texel) {
    return vec4(2.0 * texel.xyz - 1.0, texel.w * texel.w);
}

// The visibility at a position in a frame of this size. turn: from its axes to those wanted.
vec4 carried_visibility(sampler2D visibility_map, vec2 at, vec2 size, mat3 turn) {
    vec4 visibility = unpack_visibility(textureLod(visibility_map, (at + 0.5) / size, 0.0));
    return vec4(turn * visibility.xyz, visibility.w);
}

// What a matt white surface sends back of an environment, from its visibility: spherical harmonics of order 2 (Ramamoorthi,
// Hanrahan, "An Efficient Representation for Irradiance Environment Maps", 2001). What it sees is taken for a lobe around
// the bent normal whose mean cosine is that one's length; unhidden it is their cosine lobe. bands: radiance along d is
// bands[0][0] + bands[0][1] x + bands[0][2] y + bands[1][0] z + bands[1][1] xy + bands[1][2] yz + bands[2][0] xz
// + bands[2][1] (3 zz - 1) + bands[2][2] (xx - yy), in the axes of the bent normal.
vec3 environment_light(vec4 visibility, mat3 first, mat3 second, mat3 third) {
    float far = max(length(visibility.xyz), 1e-4), mean = min(far, NARROWEST);
    vec3 d = visibility.xyz / far;
    float wide = max(1.5 * mean / (2.0 - mean) - 0.5, 0.0);  // mean of the second Legendre polynomial
    vec3 along = first[1] * d.x + first[2] * d.y + second[0] * d.z;
    vec3 across = second[1] * (d.x * d.y) + second[2] * (d.y * d.z) + third[0] * (d.x * d.z)
        + third[1] * (3.0 * d.z * d.z - 1.0) + third[2] * (d.x * d.x - d.y * d.y);
    return visibility.w * max(first[0] + mean * along + wide * across, LEAST * first[0]);
}

// What a highlight takes of the mean radiance in its lobe: as much as of the light of many lamps, of which Phong's model
// takes cos^s each, with the light that makes a white surface white where it falls straight.
float highlight_strength(vec4 material) {
    return material.z * 2.0 / (material.w + 1.0);
}

// The share of a highlight's lobe that is not hidden. Both the lobe and what a point sees are taken for caps of the sphere,
// which overlap (Oat, Sander, "Ambient Aperture Lighting", 2007): the lobe for one of its mean cosine, (s + 1)/(s + 2), the
// other for one round the bent normal with the cosine-weighted share (Jimenez et al., "Practical Realtime Strategies for
// Accurate Indirect Occlusion", 2016).
float highlight_visibility(vec4 visibility, vec3 mirrored, float shininess) {
    float far = max(length(visibility.xyz), 1e-4);
    float open = sqrt(clamp(1.0 - visibility.w, 0.0, 1.0)), lobe = shininess / (shininess + 2.0);  // cosines
    float wide = acos(open), narrow = acos(lobe);
    float apart = acos(clamp(dot(visibility.xyz, mirrored) / far, -1.0, 1.0));
    float covered = 1.0 - smoothstep(abs(wide - narrow), wide + narrow + 1e-4, apart);
    return covered * min((1.0 - open) / (1.0 - lobe), 1.0);
}

// The mean radiance of an environment in a lobe around a direction, in the environment's axes. lobe_map: pictures of the
// whole sphere, one above the other, with columns from -x over -z, x and z to -x, and rows from y to -y.
vec3 texture_of_lobes(sampler2D lobe_map, vec3 direction, float lobe, float lobes) {
    float around = atan(direction.z, direction.x) / 6.2831853 + 0.5;
    float down = acos(clamp(direction.y / max(length(direction), 1e-20), -1.0, 1.0)) / 3.14159265;
    float half_row = 0.5 * lobes / float(textureSize(lobe_map, 0).y);
    return textureLod(lobe_map, vec2(around, (lobe + clamp(down, half_row, 1.0 - half_row)) / lobes), 0.0).rgb;
}

// What is left of a visibility when more is hidden, of which the rest is known: as if both hid by chance.
vec4 both_visible(vec4 one, vec4 other, vec3 n) {
    float certain = max(length(n), 1e-4);
    return vec4(one.xyz + other.xyz - OPEN * n / certain, one.w * other.w);
}
