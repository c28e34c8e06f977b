in float along;

uniform bool encode;

out vec4 shown;

void main() {
    vec3 colour = mix(vec3(0.0, 0.12, 0.5), vec3(0.1, 0.9, 1.0), along);
    shown = vec4(encode ? srgb(colour) : colour, 1.0);
}
