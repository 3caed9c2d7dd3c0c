// Weights of averages that halve a side and keep totals also for odd sizes, where a clamped 2×2 average or a blit would not: from 2n+1 to
// n texels output i weighs inputs 2i, 2i+1, 2i+2 by (n-i, n, i+1) / (2n+1). The same as `polyphase` in src/client/reference/mips.rs.

// Inputs of one output along x and y: 2 where the extent is even, 3 where it is odd, 1 where it is 1.
layout(constant_id = 0) const int TAPS_X = 3;
layout(constant_id = 1) const int TAPS_Y = 3;

// Weights of the inputs 2i, 2i+1 and 2i+2 along one axis of `n` texels.
vec3 axis_weights(const int taps, int n, int i) {
    if (taps == 1) {
        return vec3(1.0, 0.0, 0.0);
    }
    if (taps == 2) {
        return vec3(0.5, 0.5, 0.0);
    }
    int half_n = n >> 1;
    return vec3(half_n - i, half_n, i + 1) / float(n);
}
