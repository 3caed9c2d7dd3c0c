// Adaptive filtering of the light stream: what its shaders have in common. Reference: src/client/reference/adaptive_filter.rs.

#define ADAPTIVE_PUSH
#include "include/layout.glsl"

// Weights of the coarser texels i-1, i and i+1 for texel `j` of `m` finer ones along one axis.
vec3 interpolation(int m, int j) {
    float n = float(m >> 1);
    float i = float(j >> 1);
    if (m == 1) {
        return vec3(0.0, 1.0, 0.0);
    }
    if ((m & 1) == 0) {
        return (j & 1) == 0 ? vec3(0.25, 0.75, 0.0) : vec3(0.0, 0.75, 0.25);
    }
    return (j & 1) == 0 ? vec3(0.25 + 0.5 * i / n, 0.25 + 0.5 * (n - i) / n, 0.0)
                        : vec3(0.25 * i / n, 0.5 + 0.25 * (n + 1.0) / n, 0.25 * (n - i - 1.0) / n);
}

// A level at texel `at` of the next finer one, whose extent is `push.extent`.
vec4 interpolated(sampler2D coarse, ivec2 at) {
    vec3 wx = interpolation(push.extent.x, at.x);
    vec3 wy = interpolation(push.extent.y, at.y);
    ivec2 first = (at >> 1) - 1;
    ivec2 last = textureSize(coarse, 0) - 1;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < 3; ++y) {
        vec4 row = vec4(0.0);
        for (int x = 0; x < 3; ++x) {
            row += wx[x] * texelFetch(coarse, clamp(first + ivec2(x, y), ivec2(0), last), 0);
        }
        sum += wy[y] * row;
    }
    return sum;
}
