// Rounding to steps with a pattern that hides them. The same as src/client/dither.rs.

const uint UNDITHERED = 0u;
const uint ORDERED = 1u;
const uint BLUE_NOISE = 2u;

// Ordered dither of 8x8 (Bayer 1973), in (0, 1): the bits of x^y and y, interleaved from the lowest one.
float bayer(ivec2 at) {
    int v = 0;
    for (int k = 0; k < 3; ++k) {
        v = 4 * v + 2 * (((at.x ^ at.y) >> k) & 1) + ((at.y >> k) & 1);
    }
    return (float(v) + 0.5) / 64.0;
}

// The mask's shifts for red, green and blue: in step, the three would make the noise grey and as visible as it can be.
const ivec2 SHIFTS[3] = ivec2[3](ivec2(0, 0), ivec2(21, 37), ivec2(43, 13));

// The threshold that is added before rounding down, per channel, in (0, 1).
vec3 thresholds(const uint kind, sampler2D mask, ivec2 at) {
    if (kind == ORDERED) {
        return vec3(bayer(at));
    }
    if (kind == BLUE_NOISE) {
        vec3 t;
        for (int c = 0; c < 3; ++c) {
            t[c] = texelFetch(mask, (at + SHIFTS[c]) & 63, 0).r;
        }
        return t;
    }
    return vec3(0.5);
}
