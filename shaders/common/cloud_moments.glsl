// Sums over the neighbours of a point of a cloud. Offsets are from the point itself, in radii: float32 would lose them
// in coordinates.

const int CLOUD_WIDTH = 4096;  // of the textures that hold a value for each point, one after the other

struct Moments {
    float weight;   // sums, weighted: less further out
    vec3 offset;
    vec3 squares;   // xx, yy, zz
    vec3 products;  // yz, zx, xy
    vec4 plain;     // sums, not weighted: offsets, and how many neighbours
};

// Where value k lies in such a texture.
ivec2 cloud_texel(int k) {
    return ivec2(k % CLOUD_WIDTH, k / CLOUD_WIDTH);
}

// One more neighbour, which stands for `count` of them. Beyond the radius it does not count.
Moments add_neighbour(Moments m, vec3 d, float count) {
    float near = max(1.0 - dot(d, d), 0.0), w = count * near * near;
    m.weight += w;
    m.offset += w * d;
    m.squares += w * d * d;
    m.products += w * d.yzx * d.zxy;
    m.plain += near > 0.0 ? count * vec4(d, 1.0) : vec4(0.0);
    return m;
}

// The neighbours within the radius that lie in a slab: all whose offset along slab.xyz differs from slab.w by at most 1
// radius; a slab is thinner if slab.xyz is longer. Of a range of cells with more than `most` points each k-th is seen.
Moments gather_moments(sampler2D point_map, isampler2D range_map, int cell, vec3 here, float radius, vec4 slab,
        int most) {
    Moments m = Moments(0.0, vec3(0.0), vec3(0.0), vec3(0.0), vec4(0.0));
    float scale = 1.0 / radius;
    for (int k = 0; k < 9; ++k) {
        ivec2 range = texelFetch(range_map, cloud_texel(9 * cell + k), 0).xy;
        int stride = 1 + (range.y - range.x - 1) / most;
        for (int i = range.x; i < range.y; i += stride) {
            vec3 d = (texelFetch(point_map, cloud_texel(i), 0).xyz - here) * scale;
            if (abs(dot(slab.xyz, d) - slab.w) <= 1.0) m = add_neighbour(m, d, float(stride));
        }
    }
    return m;
}
