// Pinhole camera. intrinsics = (fx, fy, cx, cy) in pixels; axes x right, y down, z forward.

// The point at depth 1 on the ray of a pixel.
vec3 pixel_ray(vec2 pixel, vec4 intrinsics) {
    return vec3((pixel - intrinsics.zw) / intrinsics.xy, 1.0);
}

vec2 project(vec3 point, vec4 intrinsics) {
    return intrinsics.xy * point.xy / point.z + intrinsics.zw;
}

// One number for both axes, pixels.
float mean_focal_length(vec4 intrinsics) {
    return 0.5 * (abs(intrinsics.x) + abs(intrinsics.y));
}
