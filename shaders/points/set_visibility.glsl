// What the splats of several frames left at the pixels of a view, see common/parts.glsl.
#if LOOK_UP
layout(std430, binding = 0) restrict readonly buffer Nearest { uint nearest[]; };  // by the compute rasteriser
uniform ivec2 target_size;

uint key_at(ivec2 pixel) {
    return nearest[pixel.y * target_size.x + pixel.x];
}
#else
uniform isampler2D keys;  // by the points

uint key_at(ivec2 pixel) {
    return uint(texelFetch(keys, pixel, 0).r);
}
#endif
