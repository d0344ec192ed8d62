#include "common/cloud_moments.glsl"

// The plane through the neighbours of a point of a cloud: principal axes of their offsets. All lengths are in radii.

const float LEAST_NEIGHBOURS = 6.0;
const float THICKEST = 0.3;    // thicker is no surface
const float FARTHEST = 0.35;   // from a point to its plane: farther, and the point lies beside a surface
const float ROUNDEST = 0.4;    // of the lesser variance along a surface: foliage has more across
const float NARROWEST = 0.03;  // of the variance along a surface: a line has less across

// A plane is kept as its normal, 1 + thickness long, and how far along it the plane lies from the point. Without a plane
// it is 0 0 0 and one of these:
const float FEW = 0.0, LINE = 1.0, THICK = 2.0;

// Variances along the principal axes, ascending, by the trigonometric solution (Smith 1961).
vec3 principal_variances(vec3 squares, vec3 products) {
    float mean = (squares.x + squares.y + squares.z) / 3.0;
    vec3 rest = squares - mean;
    float spread = sqrt(max(dot(rest, rest) + 2.0 * dot(products, products), 0.0) / 6.0);
    if (!(spread > 1e-12)) return vec3(mean);
    rest /= spread;
    vec3 p = products / spread;
    float determinant = rest.x * rest.y * rest.z + 2.0 * p.x * p.y * p.z - dot(rest, p * p);
    float angle = acos(clamp(0.5 * determinant, -1.0, 1.0)) / 3.0;
    float most = mean + 2.0 * spread * cos(angle), least = mean + 2.0 * spread * cos(angle + 2.0943951);
    return vec3(least, 3.0 * mean - most - least, most);
}

// The axis of a variance: the longest cross product of two rows of the covariance without it. 0 if there is none.
vec3 principal_axis(vec3 squares, vec3 products, float variance) {
    vec3 s = squares - variance, p = products;
    vec3 a = cross(vec3(s.x, p.z, p.y), vec3(p.z, s.y, p.x));
    vec3 b = cross(vec3(p.z, s.y, p.x), vec3(p.y, p.x, s.z));
    vec3 c = cross(vec3(p.y, p.x, s.z), vec3(s.x, p.z, p.y));
    float aa = dot(a, a), bb = dot(b, b), cc = dot(c, c);
    vec3 longest = aa >= bb && aa >= cc ? a : bb >= cc ? b : c;
    float size = max(max(aa, bb), cc);
    return size > 1e-30 ? longest * inversesqrt(size) : vec3(0.0);
}

// The plane of least squares.
vec4 fit_plane(Moments m) {
    vec3 mean = m.offset / max(m.weight, 1e-20);
    vec3 squares = m.squares / max(m.weight, 1e-20) - mean * mean;
    vec3 products = m.products / max(m.weight, 1e-20) - mean.yzx * mean.zxy;
    vec3 variances = principal_variances(squares, products);
    vec3 n = principal_axis(squares, products, variances.x);
    float thickness = sqrt(max(dot(n * n, squares) + 2.0 * dot(n.yzx * n.zxy, products), 0.0));
    float offset = dot(n, mean);
    if (m.plain.w < LEAST_NEIGHBOURS) return vec4(0.0, 0.0, 0.0, FEW);
    if (variances.y < NARROWEST * variances.z) return vec4(0.0, 0.0, 0.0, LINE);
    bool is_blob = thickness > THICKEST || variances.x > ROUNDEST * variances.y;
    if (is_blob || abs(offset) > FARTHEST) return vec4(0.0, 0.0, 0.0, THICK);
    return vec4(n * (1.0 + thickness), offset);
}

// How far aside the neighbours lie: their mean without its part along the normal; and how many there are.
vec4 lean_of(Moments m, vec4 plane) {
    vec3 mean = m.plain.xyz / max(m.plain.w, 1.0);
    float length2 = max(dot(plane.xyz, plane.xyz), 1e-20);
    return vec4(mean - plane.xyz * (dot(plane.xyz, mean) / length2), m.plain.w);
}
