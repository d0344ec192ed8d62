// What a rim is in its frame, in four texels: it is estimated once for all views.

mat4 packed_rim(ivec2 pixel, Rim rim) {
    bvec2 second = bvec2(rim.folds[1].x > 0.0, rim.folds[3].x > 0.0);  // of the folds on a line
    vec3 across = second.x ? rim.folds[1] : rim.folds[0], down = second.y ? rim.folds[3] : rim.folds[2];
    float flags = dot(rim.hidden, vec4(1.0, 4.0, 16.0, 64.0)) + dot(vec2(second), vec2(256.0, 512.0));
    return mat4(vec4(pixel, flags, 0.0), vec4(rim.outward, rim.width, rim.drop), vec4(rim.slope, down.yz), vec4(across, down.x));
}

Rim unpacked_rim(mat4 kept) {
    int flags = int(kept[0].z);
    vec4 hidden = vec4((ivec4(flags) >> ivec4(0, 2, 4, 6)) & 3);
    vec3 across = kept[3].xyz, down = vec3(kept[3].w, kept[2].zw);
    bvec2 second = notEqual(ivec2(flags) & ivec2(256, 512), ivec2(0));
    mat4x3 folds = mat4x3(0.0);
    folds[0] = second.x ? vec3(0.0) : across;
    folds[1] = second.x ? across : vec3(0.0);
    folds[2] = second.y ? vec3(0.0) : down;
    folds[3] = second.y ? down : vec3(0.0);
    return Rim(kept[1].xy, kept[1].z, kept[1].w, kept[2].xy, hidden, folds);
}
