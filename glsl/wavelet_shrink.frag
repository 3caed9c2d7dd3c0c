#version 460
#extension GL_GOOGLE_include_directive : require

// The gain of a band by its signal and noise, and what it takes from the result. Where a half has nothing the result is what is around.

#include "include/wavelet.glsl"
#include "include/wavelet_mean.glsl"

// The result is still the mean of both halves.
layout(constant_id = 1) const bool FIRST = false;

layout(set = 0, binding = 0) uniform sampler2D means;
layout(set = 0, binding = 1) uniform sampler2D weights;
layout(set = 0, binding = 2) uniform sampler2D band;
// The result so far, and the gain of the band before.
layout(set = 0, binding = 3) uniform sampler2D before;
layout(set = 0, binding = 4) uniform sampler2D sums_a;
layout(set = 0, binding = 5) uniform sampler2D sums_b;
layout(set = 0, binding = 6) uniform sampler2D coarser_a;
layout(set = 0, binding = 7) uniform sampler2D coarser_b;

layout(location = 0) out vec4 result;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec2 power = mean_power(means, weights, at);
    // The least normal number keeps 0/0 away.
    float gain = max(power.x - power.y, 0.0) / (power.x + power.y + 1.17549435e-38);
    vec4 taken = texelFetch(band, at, 0);
    vec3 kept;
    if (taken.w > 0.0) {
        kept = mean_of_halves(texelFetch(coarser_a, at, 0), texelFetch(coarser_b, at, 0));
    } else if (FIRST) {
        kept = mean_of_halves(texelFetch(sums_a, at, 0), texelFetch(sums_b, at, 0));
    } else {
        kept = texelFetch(before, at, 0).xyz;
    }
    result = vec4(kept - (1.0 - gain) * taken.xyz, gain);
}
