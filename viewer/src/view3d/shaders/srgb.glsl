// IEC 61966-2-1, as radiosity::shade::srgb_from_linear.
vec3 srgb(vec3 linear) {
    linear = clamp(linear, 0.0, 1.0);
    vec3 high = 1.055 * pow(max(linear, 1e-6), vec3(1.0 / 2.4)) - 0.055;
    return mix(high, 12.92 * linear, vec3(lessThanEqual(linear, vec3(0.0031308))));
}
