// The noise filter for the display: what its passes share. The same as src/client/wavelet.

#define WAVELET_PUSH
#include "include/layout.glsl"

// Pixels of other features are not mixed; without, all pixels of the picture are alike.
layout(constant_id = 0) const bool FEATURES = true;

// The neighbours of a pixel in steps: to the right, below right, below and below left, and those opposite.
const ivec2 NEIGHBOURS[8] = ivec2[](
    ivec2(1, 0), ivec2(1, 1), ivec2(0, 1), ivec2(-1, 1), ivec2(-1, 0), ivec2(-1, -1), ivec2(0, -1), ivec2(1, -1)
);

bool is_inside(ivec2 at) {
    return all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, push.extent));
}

// Weight of neighbour i of the pixel; `weights` holds those of every pixel to its first four neighbours.
float weight_to(sampler2D weights, ivec2 at, int i) {
    ivec2 there = at + NEIGHBOURS[i] * push.step;
    if (!is_inside(there)) {
        return 0.0;
    }
    return FEATURES ? texelFetch(weights, i < 4 ? at : there, 0)[i % 4] : 1.0;
}

// The mean of both halves; that of one where the other has nothing, and zero where there is neither.
vec3 mean_of_halves(vec4 a, vec4 b) {
    vec3 mean_a = a.xyz / a.w;
    vec3 mean_b = b.xyz / b.w;
    if (a.w > 0.0 && b.w > 0.0) {
        return 0.5 * (mean_a + mean_b);
    }
    return a.w > 0.0 ? mean_a : b.w > 0.0 ? mean_b : vec3(0.0);
}
