// The Gaussian of the reconstruction with any radius and window (TAPS and EXPONENT of the including shader): to compare
// windowed_gaussian, the usual one, with. Needs gaussian.glsl. Reference: src/client/reference/kernel.rs.

// Mean of the TAPS × TAPS texels around `p` by exp(-sigma d^2) (1 - smoothstep(0, R, d)^E), R = TAPS / 2. Out-of-range texels
// are skipped.
vec4 truncated_gaussian(TEXELS texels, vec2 p, Level level, float sigma) {
    const float radius = 0.5 * float(TAPS);
    ivec2 first = ivec2(ceil(p - radius - 0.5));
    ivec2 from = max(first, ivec2(0));
    ivec2 to = min(first + TAPS, level.size);
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    for (int y = from.y; y < to.y; ++y) {
        for (int x = from.x; x < to.x; ++x) {
            vec2 d = vec2(x, y) + 0.5 - p;
            float d2 = dot(d, d);
            float w = exp(-sigma * d2);
            if (EXPONENT > 0) {
                w *= 1.0 - pow(smoothstep(0.0, radius, sqrt(d2)), float(EXPONENT));
            }
            sum += w * texel_at(texels, level, ivec2(x, y));
            weights += w;
        }
    }
    return sum / weights;
}
