#version 330 core
// Which tiles of a view have pixels that samples are still drawn in.

uniform sampler2D open_map;  // 1 there, else 0
uniform int side;            // of a tile, pixels

out float is_drawn;

void main() {
    ivec2 first = side * ivec2(gl_FragCoord.xy), end = min(first + side, textureSize(open_map, 0));
    is_drawn = 0.0;
    for (int y = first.y; y < end.y; ++y) {
        for (int x = first.x; x < end.x; ++x) is_drawn = max(is_drawn, texelFetch(open_map, ivec2(x, y), 0).r);
    }
}
