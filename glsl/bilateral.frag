#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/layers.glsl"

// One stage of noise masking by bilateral filtering guided by the variance (paper §4.2): 5x5 texels, `stride` apart, weigh
// less the more standard errors lie between them and the centre. Reference: src/client/reference/bilateral.rs.

#define BILATERAL_PUSH
#include "include/layout.glsl"
#include "include/gather.glsl"
#include "include/lod.glsl"

// Whether it is the light stream, whose sums are shown.
layout(constant_id = 0) const bool SUMMED = false;
// Stage 0 takes neighbours, stage 1 every second texel, and so on.
layout(constant_id = 1) const uint STAGE = 0u;

// Sums, and the squared errors of what they show.
layout(set = 0, binding = 0) uniform sampler2D sums;
layout(set = 0, binding = 1) uniform sampler2D errors;
// The stream as it was received, all levels.
layout(set = 0, binding = 2) uniform sampler2D color;
layout(set = 0, binding = 3) uniform sampler2D variance;

layout(location = 0) out vec4 filtered;
layout(location = 1) out float filtered_error;

// Twice the square of the number of standard errors at which a neighbour counts 60 %.
const float TOLERANCE = 8.0;
// Squared difference that always passes, in units of the luminance scale.
const float LEAST_ERROR = 1e-6;
// Binomial coefficients: a spline, as of the a-trous wavelet transform.
const float TAPS[5] = float[5](1.0 / 16.0, 4.0 / 16.0, 6.0 / 16.0, 4.0 / 16.0, 1.0 / 16.0);

// The displayed value of the texel, in units of the luminance scale.
vec3 shown(vec4 sum) {
    if (SUMMED) {
        return sum.xyz * push.inverse_scale;
    }
    return sum.w > 0.0 ? sum.xyz / sum.w * push.inverse_scale : vec3(0.0);
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 here = texelFetch(sums, at, 0);
    float error = texelFetch(errors, at, 0).r;
    float lod = masked_lod(color, variance, gl_FragCoord.xy, 0.0, push.variance_lod,
                           SUMMED ? 1.0 : 0.0);
    float strength = clamp(lod - float(STAGE), 0.0, 1.0);
    filtered = here;
    filtered_error = error;
    if (strength <= 0.0) {
        return;
    }
    vec3 value = shown(here);
    ivec2 size = textureSize(sums, 0);
    vec4 total = vec4(0.0);
    float weights = 0.0;
    float errors_total = 0.0;
    for (int y = 0; y < 5; ++y) {
        for (int x = 0; x < 5; ++x) {
            ivec2 p = at + (ivec2(x, y) - 2) * (1 << STAGE);
            if (any(lessThan(p, ivec2(0))) || any(greaterThanEqual(p, size))) {
                continue;
            }
            vec4 there = texelFetch(sums, p, 0);
            float error_there = texelFetch(errors, p, 0).r;
            vec3 d = shown(there) - value;
            // Luminance, and what colour differs by beyond it.
            float d2 = d.y * d.y + 0.25 * ((d.x - d.y) * (d.x - d.y) + (d.z - d.y) * (d.z - d.y));
            float w = TAPS[x] * TAPS[y];
            // Nothing is known of an empty texel: it takes from all, and has nothing to give.
            if (SUMMED || (here.w > 0.0 && there.w > 0.0)) {
                w *= exp(-d2 / (TOLERANCE * (error + error_there + LEAST_ERROR)));
            }
            // False for NaN: values that overflowed.
            w = w > 0.0 ? w : 0.0;
            total += w * there;
            weights += w;
            errors_total += w * w * error_there;
        }
    }
    if (weights > 0.0) {
        filtered = mix(here, total / weights, strength);
        float deviation = mix(sqrt(error), sqrt(errors_total) / weights, strength);
        filtered_error = deviation * deviation;
    }
}
