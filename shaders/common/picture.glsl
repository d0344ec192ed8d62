// Between four pixels, the upper left and the lower right of which are given; share: of the right ones, of the lower ones.
vec3 mix_picture(sampler2D picture, ivec2 low, ivec2 high, vec2 share) {
    vec3 top = mix(texelFetch(picture, low, 0).rgb, texelFetch(picture, ivec2(high.x, low.y), 0).rgb, share.x);
    vec3 bottom = mix(texelFetch(picture, ivec2(low.x, high.y), 0).rgb, texelFetch(picture, high, 0).rgb, share.x);
    return mix(top, bottom, share.y);
}

// Bilinear sample at a position in pixels, in float: the GPU's own filter has only 8-bit weights.
vec3 sample_picture(sampler2D picture, vec2 position) {
    ivec2 last = textureSize(picture, 0) - 1;
    vec2 corner = floor(position);
    ivec2 low = clamp(ivec2(corner), ivec2(0), last);
    ivec2 high = clamp(ivec2(corner) + 1, ivec2(0), last);
    return mix_picture(picture, low, high, position - corner);
}

// Weights of the four pixels around a share of the way from the second to the third (Catmull and Rom 1974).
vec4 cubic_weights(float share) {
    float rest = 1.0 - share;
    return 0.5 * share * rest * vec4(-rest, 0.0, 0.0, -share)
        + vec4(0.0, rest * (1.0 + share * (1.0 - 1.5 * share)), share * (1.0 + rest * (1.0 - 1.5 * rest)), 0.0);
}

// As sample_picture, but from 4x4 pixels: sharper.
vec3 sample_sharply(sampler2D picture, vec2 position) {
    ivec2 last = textureSize(picture, 0) - 1, first = ivec2(floor(position)) - 1;
    vec4 across = cubic_weights(fract(position.x)), down = cubic_weights(fract(position.y));
    vec3 sum = vec3(0.0);
    for (int k = 0; k < 16; ++k) {
        ivec2 off = ivec2(k & 3, k >> 2);
        sum += across[off.x] * down[off.y] * texelFetch(picture, clamp(first + off, ivec2(0), last), 0).rgb;
    }
    return clamp(sum, 0.0, 1.0);
}

// The same place in a picture of another size; the outer edges of both pictures coincide.
vec2 rescale_position(vec2 position, vec2 size, vec2 other_size) {
    if (size == other_size) return position;
    return (position + 0.5) * (other_size / size) - 0.5;
}

// The picture at a position of another one, whose size is given.
vec3 picture_at(sampler2D picture, vec2 position, vec2 size) {
    return sample_picture(picture, rescale_position(position, size, vec2(textureSize(picture, 0))));
}
