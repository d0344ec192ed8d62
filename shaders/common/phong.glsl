// Phong's reflection model (Bui Tuong Phong, "Illumination for Computer Generated Pictures", 1975),
// in linear light. material = (ambient, diffuse, specular, shininess).

// k = (constant, linear, quadratic)
float attenuation(float distance, vec3 k) {
    return 1.0 / (k.x + k.y * distance + k.z * distance * distance);
}

// What one light adds. n surface normal, v to the eye, l to the light (all unit); light = colour that arrives.
vec3 phong(vec3 n, vec3 v, vec3 l, vec3 albedo, vec4 material, vec3 light) {
    float NoL = dot(n, l);
    if (NoL <= 0.0) return vec3(0.0);
    vec3 result = material.y * NoL * albedo;
    if (material.z > 0.0) {
        vec3 r = 2.0 * NoL * n - l;
        result += material.z * pow(max(dot(r, v), 0.0), material.w);
    }
    return result * light;
}
