// Highlights of surfaces whose normals are uncertain: the mean of many possible highlights is wider and dimmer
// (Toksvig, "Mipmapping Normal Maps", 2005). The certainty of a normal is the length that the mean of all normals has
// that it may be: 1 if there is no doubt.

const float WANDERING = 4.0;  // times the variance of noisy normals: highlights wander with these, which is seen unless
                              // they are twice as wide. A wall in stereo noise: blotches of 13 steps of 255 without,
                              // 10 with 1, 7 with 4; more also dims what is true
const float LEAST_CERTAINTY = 0.4;  // below, highlights fade: of a surface that may be any a haze would be left, seen on black
const float LEAST_SHARE = 0.4;      // of the shininess: beyond, highlights are dimmed alone. A haze would be seen where
                                    // certainty changes, as along the edges of surfaces

// Of a tilt with this variance, radians squared along each axis.
float normal_certainty(float variance) {
    return 1.0 / (1.0 + variance);
}

// Of the mean of several normals whose sum is so much shorter than all of them in a row, as they disagree: by the standard
// error of the mean. others: their number less one.
float mean_certainty(float share, float others) {
    return normal_certainty(max(1.0 / max(share, 0.5) - 1.0, 0.0) / others);
}

// The certainty at a position in a frame of this size.
float certainty_at(sampler2D certainty_map, vec2 at, vec2 size) {
    return textureLod(certainty_map, (at + 0.5) / size, 0.0).r;
}

// material = (ambient, diffuse, specular, shininess) as phong.glsl takes it. The mirrored ray turns twice as far as the
// normal: so its variance is 4 times as large, and Toksvig's factor on the shininess is that of 4 times the exponent.
vec4 widened(vec4 material, float certainty) {
    float share = certainty / (certainty + 4.0 * material.w * (1.0 - certainty));
    float dimmed = (1.0 + share * material.w) / (1.0 + material.w) * smoothstep(0.0, LEAST_CERTAINTY, certainty);
    return vec4(material.xy, dimmed * material.z, max(share, LEAST_SHARE) * material.w);
}
