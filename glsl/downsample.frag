#version 460
#extension GL_GOOGLE_include_directive : require

// One level of the mip chain, as an average that keeps totals also for odd sizes, where a clamped 2×2 average
// or a blit would not: from 2n+1 to n texels output i weighs inputs 2i, 2i+1, 2i+2 by (n-i, n, i+1) / (2n+1).

#define DOWNSAMPLE_PUSH
#include "include/layout.glsl"

// Both extents are even: the four taps with equal weights.
layout(constant_id = 0) const bool EVEN = false;
// A second image, the variance, takes the same way.
layout(constant_id = 1) const bool VARIANCE = false;

layout(set = 0, binding = 0) uniform sampler2D color;
layout(set = 0, binding = 1) uniform sampler2D variance;

layout(location = 0) out vec4 out_color;
layout(location = 1) out float out_variance;

// Weights of the inputs 2i, 2i+1 and 2i+2 along one axis of `n` texels.
vec3 axis_weights(int n, int i) {
    if (n == 1) {
        return vec3(1.0, 0.0, 0.0);
    }
    if ((n & 1) == 0) {
        return vec3(0.5, 0.5, 0.0);
    }
    int half_n = n >> 1;
    return vec3(half_n - i, half_n, i + 1) / float(n);
}

vec4 polyphase(sampler2D image, ivec2 at, vec3 wx, vec3 wy) {
    ivec2 last = push.source - 1;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < 3; ++y) {
        vec4 row = vec4(0.0);
        for (int x = 0; x < 3; ++x) {
            row += wx[x] * texelFetch(image, min(at + ivec2(x, y), last), 0);
        }
        sum += wy[y] * row;
    }
    return sum;
}

vec4 average(sampler2D image, ivec2 at) {
    vec4 top = texelFetch(image, at, 0) + texelFetch(image, at + ivec2(1, 0), 0);
    vec4 bottom = texelFetch(image, at + ivec2(0, 1), 0) + texelFetch(image, at + ivec2(1, 1), 0);
    return (top + bottom) * 0.25;
}

void main() {
    ivec2 i = ivec2(gl_FragCoord.xy);
    ivec2 at = 2 * i;
    if (EVEN) {
        out_color = average(color, at);
        if (VARIANCE) {
            out_variance = average(variance, at).r;
        }
    } else {
        vec3 wx = axis_weights(push.source.x, i.x);
        vec3 wy = axis_weights(push.source.y, i.y);
        out_color = polyphase(color, at, wx, wy);
        if (VARIANCE) {
            out_variance = polyphase(variance, at, wx, wy).r;
        }
    }
}
