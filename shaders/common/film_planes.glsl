// What the planes of a film's frames stand for: page/films.py.

// The unit normal at a place on an octahedron, 0 to 1 (Meyer et al. 2010).
vec3 unfolded_normal(vec2 place) {
    vec2 p = place * 2.0 - 1.0;
    float z = abs(p.x) + abs(p.y) - 1.0;
    vec2 inward = vec2(max(z, 0.0));
    return normalize(vec3(p - mix(-inward, inward, greaterThanEqual(p, vec2(0.0))), z));
}

// sRGB of luma and chromas, 0 to 1 (JFIF).
vec3 color_of_luma(float luma, vec2 chromas) {
    vec2 c = chromas - 128.0 / 255.0;
    return clamp(luma + vec3(1.402 * c.y, -0.344136 * c.x - 0.714136 * c.y, 1.772 * c.x), 0.0, 1.0);
}
