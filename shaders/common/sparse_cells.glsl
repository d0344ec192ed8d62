// A pyramid over a picture of which few depths are known. A cell holds the means of its known pixels: their position
// (xy), w = 1/z (z), and how many they are (w). The mean of points of a plane lies on the plane, wherever they are.

vec4 cell_of_pixel(float depth, vec2 pixel) {
    return depth > 0.0 ? vec4(pixel, 1.0 / depth, 1.0) : vec4(0.0);
}

// The cell that holds four others.
vec4 join_cells(vec4 a, vec4 b, vec4 c, vec4 d) {
    float count = a.w + b.w + c.w + d.w;
    vec3 sum = a.w * a.xyz + b.w * b.xyz + c.w * c.xyz + d.w * d.xyz;
    return vec4(sum / max(count, 1.0), count);
}

// Nothing outside the picture.
vec4 cell_at(sampler2D cells, ivec2 cell) {
    bool inside = cell == clamp(cell, ivec2(0), textureSize(cells, 0) - 1);
    return inside ? texelFetch(cells, cell, 0) : vec4(0.0);
}
