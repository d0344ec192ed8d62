// Trained splats as a camera sees them: ellipses (EWA: Zwicker et al. 2001). estimation/splat_projection.py finds the same
// on the CPU.

const float BLUR = 0.3;      // pixels squared: what the training adds to each ellipse
const float FAR_ASIDE = 1.3;  // half pictures aside beyond which the slope of a ray counts no further
const float THIN = 1e-4;     // of an ellipse: what is thinner has the depth slope of this
const float TURNED = 0.05;   // cosine: normals that point away by less stay so, as round an outline some do

// A unit quaternion x, y, z, w of four bytes, from 0 to 1: three parts of ten bits, and which is left out as the largest.
vec4 unpack_rotation(vec4 stored) {
    uvec4 parts = uvec4(255.0 * stored + 0.5);
    uint bits = parts.x | (parts.y << 8u) | (parts.z << 16u) | (parts.w << 24u), largest = bits >> 30u;
    vec3 rest = (vec3((uvec3(bits >> 20u, bits >> 10u, bits) & 1023u)) / 1023.0 - 0.5) * 1.41421356;
    float own = sqrt(max(1.0 - dot(rest, rest), 0.0));
    if (largest == 0u) return vec4(own, rest);
    if (largest == 1u) return vec4(rest.x, own, rest.yz);
    return largest == 2u ? vec4(rest.xy, own, rest.z) : vec4(rest, own);
}

// The axes of a unit quaternion x, y, z, w, in columns.
mat3 quaternion_axes(vec4 q) {
    vec3 twice = 2.0 * q.xyz, square = twice * q.xyz, with_w = twice * q.w;
    float xy = twice.x * q.y, xz = twice.x * q.z, yz = twice.y * q.z;
    return mat3(
        1.0 - square.y - square.z, xy + with_w.z, xz - with_w.y,
        xy - with_w.z, 1.0 - square.x - square.z, yz + with_w.x,
        xz + with_w.y, yz - with_w.x, 1.0 - square.x - square.y
    );
}

// How x and y of a picture, pixels, and depth change with a place that a camera sees: three columns.
mat3 picture_ways(vec3 seen, vec4 intrinsics, vec2 size) {
    vec2 end = FAR_ASIDE * 0.5 * size / abs(intrinsics.xy), near = intrinsics.xy / seen.z;
    vec2 slope = clamp(seen.xy / seen.z, -end, end);
    return mat3(near.x, 0.0, -near.x * slope.x, 0.0, near.y, -near.y * slope.y, 0.0, 0.0, 1.0);
}

// The ellipse of one deviation: the arms l11, l21, l22 take a circle to it, x = l11 a, y = l21 a + l22 b; and the opacity
// in its middle. spread: how far the three arms of a splat reach along each of the ways, a way a column
vec4 seen_ellipse(mat3 spread, float opacity, bool antialiased) {
    float xx = dot(spread[0], spread[0]), xy = dot(spread[0], spread[1]), yy = dot(spread[1], spread[1]);
    float area = (xx + BLUR) * (yy + BLUR) - xy * xy, first = sqrt(xx + BLUR);
    if (antialiased) opacity *= sqrt(max(xx * yy - xy * xy, 0.0) / area);
    return vec4(first, xy / first, sqrt(area) / first, opacity);
}

// By how much the depth where a splat is densest along the ray changes for each pixel aside.
vec2 depth_slope(mat3 spread) {
    vec3 own = vec3(dot(spread[0], spread[0]), dot(spread[0], spread[1]), dot(spread[1], spread[1]));
    vec2 deep = vec2(dot(spread[2], spread[0]), dot(spread[2], spread[1]));
    own.xz += THIN * (own.x + own.z) + 1e-9;
    return vec2(deep.x * own.z - deep.y * own.y, deep.y * own.x - deep.x * own.y) / (own.x * own.z - own.y * own.y);
}

// A unit normal, turned to the viewer.
vec3 facing_viewer(vec3 normal, vec3 seen) {
    return dot(normal, seen) > TURNED * length(seen) ? -normal : normal;
}

// Real spherical harmonics above degree 0 in a unit direction, times coefficients of colours in texels from a first one
// on. stored: from 0 to 1, which stand for -range to range; count: 0, 3, 8 or 15
vec3 shine_towards(sampler2D stored, ivec2 first, int count, float range, vec3 way) {
    float x = way.x, y = way.y, z = way.z, xx = x * x, yy = y * y, zz = z * z;
    float shown[15] = float[](
        -0.4886025119 * y, 0.4886025119 * z, -0.4886025119 * x,
        1.0925484306 * x * y, -1.0925484306 * y * z, 0.3153915653 * (2.0 * zz - xx - yy), -1.0925484306 * x * z,
        0.5462742153 * (xx - yy), -0.5900435899 * y * (3.0 * xx - yy), 2.8906114426 * x * y * z,
        -0.4570457995 * y * (4.0 * zz - xx - yy), 0.3731763326 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
        -0.4570457995 * x * (4.0 * zz - xx - yy), 1.4453057213 * z * (xx - yy), -0.5900435899 * x * (xx - 3.0 * yy)
    );
    vec3 sum = vec3(0.0);
    for (int k = 0; k < count; ++k) {
        sum += shown[k] * range * (255.0 * texelFetch(stored, first + ivec2(k, 0), 0).rgb - 128.0) / 127.0;
    }
    return sum;
}
