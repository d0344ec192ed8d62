// The front surface of a cloud: what the cores of its splats cover, and the holes between them.

const int MOST_AROUND = 6;     // of eight directions in which a hole has its surface around it
const float FARTHEST_RING = 60.0;  // pixels

// z at a pixel of a depth picture, 1 - near/z; 0 where there is nothing, and beside the picture.
float front_depth(sampler2D cores, ivec2 pixel, float near) {
    bool is_inside = pixel == clamp(pixel, ivec2(0), textureSize(cores, 0) - 1);
    float depth = is_inside ? texelFetch(cores, pixel, 0).r : 1.0;
    return depth < 1.0 ? near / (1.0 - depth) : 0.0;
}

// The pixel step in one of eight directions.
ivec2 ring_step(int direction, float distance) {
    float angle = 0.785398163 * float(direction);
    return ivec2(floor(distance * vec2(cos(angle), sin(angle)) + 0.5));
}

// Of eight pixels around: how many show what is nearer than z (0: than nothing) by more than `step_back`; the nearest
// and the farthest of these.
vec3 nearer_around(
    sampler2D cores, ivec2 pixel, float near, float z, float step_back, float distance, int directions
) {
    vec3 found = vec3(0.0);
    for (int k = 0; k < directions; ++k) {
        float other = front_depth(cores, pixel + ring_step(k, distance), near);
        if (other == 0.0 || (z > 0.0 && z - other < step_back)) continue;
        found = vec3(found.x + 1.0, found.x == 0.0 ? other : min(found.y, other), max(found.z, other));
    }
    return found;
}

// The depth at a pixel; in a hole that of the farthest splat around it. ring: how far apart splats are, in pixels at
// depth 1, and in most of the picture.
float closed_depth(sampler2D cores, ivec2 pixel, float near, float step_back, vec2 ring) {
    float z = front_depth(cores, pixel, near);
    vec3 beside = nearer_around(cores, pixel, near, z, step_back, clamp(ring.y, 1.0, FARTHEST_RING), 8);
    int directions = beside.x > 3.0 ? 8 : 0;  // no constant: software drivers would always look
    float distance = clamp(ring.x / max(beside.y, near), 1.0, FARTHEST_RING);
    vec3 around = nearer_around(cores, pixel, near, z, step_back, distance, directions);
    return around.x >= float(MOST_AROUND) ? around.z : z;
}
