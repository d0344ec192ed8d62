// Reads pictures texel by texel. A sampler read at the texel's centre takes half the time of texelFetch on llvmpipe. It
// needs NEAREST filtering; the wrap mode does not matter. Programs for software drivers have these functions also for
// images, which are faster still, see gpu/context/software_driver.py.

vec4 texel_at(sampler2D map, ivec2 pixel) {
    return textureLod(map, (vec2(pixel) + 0.5) * (1.0 / vec2(textureSize(map, 0))), 0.0);
}

// The same, 0 outside the picture.
vec4 texel_or_zero(sampler2D map, ivec2 pixel) {
    bool is_inside = pixel == clamp(pixel, ivec2(0), textureSize(map, 0) - 1);
    return is_inside ? texel_at(map, pixel) : vec4(0.0);
}

// Depth at pixel + offset, 0 outside the picture.
float depth_at(sampler2D map, ivec2 pixel, ivec2 offset) {
    vec2 at = (vec2(pixel + offset) + 0.5) * (1.0 / vec2(textureSize(map, 0)));
    float z = textureLod(map, at, 0.0).r;
    return at == clamp(at, vec2(0.0), vec2(1.0)) ? z : 0.0;
}

// The same of depth and its noise.
vec2 depth_and_noise_at(sampler2D map, ivec2 pixel, ivec2 offset) {
    vec2 at = (vec2(pixel + offset) + 0.5) * (1.0 / vec2(textureSize(map, 0)));
    vec2 texel = textureLod(map, at, 0.0).rg;
    return at == clamp(at, vec2(0.0), vec2(1.0)) ? texel : vec2(0.0);
}
