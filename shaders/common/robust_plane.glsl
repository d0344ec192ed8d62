// Robust planes through 5x5 samples d of a function, with weights m (1 known, 0 missing); variance: of one sample.

const float GATE = 5.0;          // standard deviations from which on a sample has no weight
const float OUTLIER = 9.0;       // variances that an outlier costs a candidate
const float BEND = 10.0;         // variances from which a bend counts as more than noise, which has 2 of them
const float CENTRE_FIRST = 0.8;  // factor on the cost of the centre candidate, which prefers no side

// Plane (value at the pixel, slope per sample in u and v) by least squares, from sums of weights and products.
vec3 solve_plane(float s, float su, float sv, float suu, float suv, float svv, float sd, float sud, float svd) {
    float mean_u = su / max(s, 1e-6), mean_v = sv / max(s, 1e-6), mean_d = sd / max(s, 1e-6);
    float uu = suu - su * mean_u, uv = suv - su * mean_v, vv = svv - sv * mean_v;
    float ud = sud - su * mean_d, vd = svd - sv * mean_d;
    float determinant = uu * vv - uv * uv;
    float over = determinant > 1e-3 ? 1.0 / determinant : 0.0;
    float slope_u = (vv * ud - uv * vd) * over, slope_v = (uu * vd - uv * ud) * over;
    return vec3(mean_d - slope_u * mean_u - slope_v * mean_v, slope_u, slope_v);
}

// Quadratic surface through all 25 samples: value (x) and slope (yz) in the centre, and the squares that remain (w). The
// slope is also that of the plane. The value becomes the plane's where the bend may well be noise: that is calmer.
vec4 fit_bowl(float d[25], float variance) {
    float sum = 0.0, squares = 0.0, u = 0.0, v = 0.0, uu = 0.0, vv = 0.0, uv = 0.0;
    for (int k = 0; k < 25; ++k) {
        int x = k % 5 - 2, y = k / 5 - 2;
        sum += d[k];
        squares += d[k] * d[k];
        u += d[k] * float(x);
        v += d[k] * float(y);
        uu += d[k] * float(x * x - 2);
        vv += d[k] * float(y * y - 2);
        uv += d[k] * float(x * y);
    }
    float rest = squares - sum * sum / 25.0 - (u * u + v * v) / 50.0 - (uu * uu + vv * vv) / 70.0 - uv * uv / 100.0;
    float bend = uu * uu + vv * vv, noise = 70.0 * BEND * variance;
    float certain = bend * bend / max(bend * bend + noise * noise, 1e-30);
    return vec4(sum / 25.0 - certain * (uu + vv) / 35.0, u / 50.0, v / 50.0, rest);
}

// Plane through 3x3 of the samples. Their middle is at u and v = -1, 0 or 1; the plane's value is that at the pixel.
vec3 corner_plane(float d[25], float m[25], int u, int v) {
    int i = 5 * v + u + 6;
    float top = m[i] + m[i + 1] + m[i + 2], mid = m[i + 5] + m[i + 6] + m[i + 7];
    float low = m[i + 10] + m[i + 11] + m[i + 12];
    float left = m[i] + m[i + 5] + m[i + 10], right = m[i + 2] + m[i + 7] + m[i + 12];
    float sd = d[i] + d[i + 1] + d[i + 2] + d[i + 5] + d[i + 6] + d[i + 7] + d[i + 10] + d[i + 11] + d[i + 12];
    float sud = (d[i + 2] + d[i + 7] + d[i + 12]) - (d[i] + d[i + 5] + d[i + 10]);
    float svd = (d[i + 10] + d[i + 11] + d[i + 12]) - (d[i] + d[i + 1] + d[i + 2]);
    vec3 plane = solve_plane(top + mid + low, right - left, low - top, right + left,
        m[i] - m[i + 2] - m[i + 10] + m[i + 12], top + low, sd, sud, svd);
    plane.x -= plane.y * float(u) + plane.z * float(v);
    return plane;
}

// What a plane does not explain: the sum of capped squares over all samples, and four times that of the pixel itself.
float plane_cost(float d[25], float m[25], vec3 plane, float variance) {
    float cost = 4.0 * max(plane.x * plane.x - OUTLIER * variance, 0.0);
    for (int j = 0; j < 25; ++j) {
        float miss = d[j] - (plane.x + plane.y * float(j % 5 - 2) + plane.z * float(j / 5 - 2));
        cost += m[j] * min(miss * miss, OUTLIER * variance);
    }
    return cost;
}

// The best of five planes: through the centre 3x3 of the samples and through the four 3x3 corners, all of which
// contain the pixel. At an edge one of the corners lies on the pixel's own side. Written out: indexed arrays are slow.
vec3 best_corner(float d[25], float m[25], float variance) {
    vec3 a = corner_plane(d, m, -1, -1), b = corner_plane(d, m, 1, -1), c = corner_plane(d, m, 0, 0);
    vec3 e = corner_plane(d, m, -1, 1), f = corner_plane(d, m, 1, 1);
    float cost_a = plane_cost(d, m, a, variance), cost_b = plane_cost(d, m, b, variance);
    float cost_c = CENTRE_FIRST * plane_cost(d, m, c, variance);
    float cost_e = plane_cost(d, m, e, variance), cost_f = plane_cost(d, m, f, variance);
    float least = min(min(min(cost_a, cost_b), min(cost_e, cost_f)), cost_c);
    return least == cost_a ? a : least == cost_b ? b : least == cost_c ? c : least == cost_e ? e : f;
}

// One round of least squares with biweights (Beaton, Tukey 1974). fit: chi square per sample of the given plane, and
// the spread of the weighted samples across their narrowest direction.
vec3 refine_plane(float d[25], float m[25], vec3 plane, float variance, out vec2 fit) {
    float s = 0.0, su = 0.0, sv = 0.0, suu = 0.0, suv = 0.0, svv = 0.0, sd = 0.0, sud = 0.0, svd = 0.0, squares = 0.0;
    float scale = 1.0 / (GATE * GATE * variance);
    for (int j = 0; j < 25; ++j) {
        float u = float(j % 5 - 2), v = float(j / 5 - 2);
        float miss = d[j] - (plane.x + plane.y * u + plane.z * v);
        float near = max(1.0 - miss * miss * scale, 0.0);
        float weight = m[j] * near * near;
        s += weight;
        su += weight * u;
        sv += weight * v;
        suu += weight * (u * u);
        suv += weight * (u * v);
        svv += weight * (v * v);
        float product = weight * d[j];
        sd += product;
        sud += product * u;
        svd += product * v;
        squares += weight * miss * miss;
    }
    float uu = suu - su * su / max(s, 1e-6), uv = suv - su * sv / max(s, 1e-6), vv = svv - sv * sv / max(s, 1e-6);
    float narrow = 0.5 * (uu + vv - sqrt((uu - vv) * (uu - vv) + 4.0 * uv * uv));
    fit = vec2(squares / (variance * max(s - 3.0, 0.5)), narrow);
    return solve_plane(s, su, sv, suu, suv, svv, sd, sud, svd);
}
