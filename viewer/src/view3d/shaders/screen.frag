// The picture, pixel for pixel, encoded for a framebuffer that does not encode.

uniform highp sampler2D picture;
uniform ivec2 corner; // where the picture begins in the window
uniform bool encode;

out vec4 shown;

void main() {
    vec3 colour = texelFetch(picture, ivec2(gl_FragCoord.xy) - corner, 0).rgb;
    shown = vec4(encode ? srgb(colour) : colour, 1.0);
}
