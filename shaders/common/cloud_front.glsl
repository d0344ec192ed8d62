// The front surface of a cloud: what the cores of its splats cover, and the holes between them.

const float FARTHEST_RING = 60.0;  // pixels
const int PAIRS = 3;               // of four: so many pairs of opposite places around a hole show its surface
const int RINGS = 3;               // around a hole, each wider by the first: the narrowest that spans it counts
const float SAME = 0.5;            // of `step_back`: the middles between such places differ by less

// z at a pixel of a depth picture, 1 - near/z; 0 where there is nothing, and beside the picture.
float front_depth(sampler2D cores, ivec2 pixel, float near) {
    bool is_inside = pixel == clamp(pixel, ivec2(0), textureSize(cores, 0) - 1);
    float depth = is_inside ? texelFetch(cores, pixel, 0).r : 1.0;
    return depth < 1.0 ? near / (1.0 - depth) : 0.0;
}

// The step in one of eight directions, pixels; four on is the opposite one.
ivec2 ring_step(int direction, float distance) {
    float angle = 0.785398163 * float(direction);
    return ivec2(floor(distance * vec2(cos(angle), sin(angle)) + 0.5));
}

// Is this nearer than z (0: than nothing) by more than `step_back`?
bool is_before(float other, float z, float step_back) {
    return other > 0.0 && (z == 0.0 || z - other > step_back);
}

// Of the pairs of opposite places around a pixel: how many are both nearer than z, the mean of their middles' depths, and
// by how much these differ.
vec3 around_hole(sampler2D cores, ivec2 pixel, float near, float z, float step_back, float distance, int pairs) {
    float count = 0.0, sum = 0.0, low = 0.0, high = 0.0;
    for (int k = 0; k < pairs; ++k) {
        ivec2 aside = ring_step(k, distance);
        float one = front_depth(cores, pixel + aside, near), other = front_depth(cores, pixel - aside, near);
        if (!is_before(one, z, step_back) || !is_before(other, z, step_back)) continue;
        float middle = 0.5 * (one + other);
        low = count == 0.0 ? middle : min(low, middle);
        high = max(high, middle);
        sum += middle;
        count += 1.0;
    }
    return vec3(count, sum / max(count, 1.0), high - low);
}

// Is there one surface on all sides of a hole?
bool shows_surface(vec3 around, float step_back) {
    return around.x >= float(PAIRS) && around.z <= SAME * step_back;
}

// The depth at a pixel; in a hole that of the surface around it. ring: how far apart splats are, in pixels at depth 1, and
// in most of the picture.
float closed_depth(sampler2D cores, ivec2 pixel, float near, float step_back, vec2 ring) {
    float z = front_depth(cores, pixel, near);
    vec3 beside = around_hole(cores, pixel, near, z, step_back, clamp(2.0 * ring.y, 2.0, FARTHEST_RING), 4);
    int rings = beside.x > 0.0 ? RINGS : 0;  // no constant: software drivers would always look
    float distance = clamp(ring.x / max(beside.y, near), 1.0, FARTHEST_RING);
    for (int k = 1; k <= rings; ++k) {
        vec3 around = around_hole(cores, pixel, near, z, step_back, distance * float(k), 4);
        if (shows_surface(around, step_back)) return around.y;
    }
    return z;
}
