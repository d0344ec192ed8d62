#version 330 core
// A drawing laid over part of the window, pixel by pixel; its first row is on top.

uniform sampler2D drawing;
uniform ivec2 corner;  // of the drawing's lower left pixel, in the window

out vec4 color;

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy) - corner;
    color = texelFetch(drawing, ivec2(place.x, textureSize(drawing, 0).y - 1 - place.y), 0);
}
