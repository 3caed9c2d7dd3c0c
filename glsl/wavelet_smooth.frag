#version 460
#extension GL_GOOGLE_include_directive : require

// One level of the noise filter: the smoothed sums, and the band between them and those before.

#include "include/wavelet.glsl"

layout(set = 0, binding = 0) uniform sampler2D sums_a;
layout(set = 0, binding = 1) uniform sampler2D sums_b;
layout(set = 0, binding = 2) uniform sampler2D weights;

layout(location = 0) out vec4 coarser_a;
layout(location = 1) out vec4 coarser_b;
// Mean of the bands of both halves; w is 1 where one of them has nothing here and there is something around.
layout(location = 2) out vec4 band;
// The product of the luminances of both bands, and the noise of their mean.
layout(location = 3) out vec2 power;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 here_a = texelFetch(sums_a, at, 0);
    vec4 here_b = texelFetch(sums_b, at, 0);
    coarser_a = 4.0 * here_a;
    coarser_b = 4.0 * here_b;
    float total = 4.0;
    for (int i = 0; i < 8; ++i) {
        ivec2 there = at + NEIGHBOURS[i] * push.step;
        // Binomial coefficients over that of the corner.
        float w = (i % 2 == 0 ? 2.0 : 1.0) * weight_to(weights, at, i);
        if (w > 0.0) {
            coarser_a += w * texelFetch(sums_a, there, 0);
            coarser_b += w * texelFetch(sums_b, there, 0);
            total += w;
        }
    }
    coarser_a /= total;
    coarser_b /= total;
    if (here_a.w > 0.0 && here_b.w > 0.0) {
        vec3 a = here_a.xyz / here_a.w - coarser_a.xyz / coarser_a.w;
        vec3 b = here_b.xyz / here_b.w - coarser_b.xyz / coarser_b.w;
        band = vec4(0.5 * (a + b), 0.0);
        power = vec2(a.y * b.y, 0.25 * (a.y - b.y) * (a.y - b.y));
    } else {
        band = vec4(0.0, 0.0, 0.0, coarser_a.w + coarser_b.w > 0.0 ? 1.0 : 0.0);
        power = vec2(0.0);
    }
}
