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

// The same place in a picture of another size; the outer edges of both pictures coincide.
vec2 rescale_position(vec2 position, vec2 size, vec2 other_size) {
    if (size == other_size) return position;
    return (position + 0.5) * (other_size / size) - 0.5;
}

// The picture at a position of another one, whose size is given.
vec3 picture_at(sampler2D picture, vec2 position, vec2 size) {
    return sample_picture(picture, rescale_position(position, size, vec2(textureSize(picture, 0))));
}
