#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/layers.glsl"

// Adaptive filtering: what the widths of kernels are taken from, [Y, Y²/W] of every pixel of the picture.

#include "include/adaptive.glsl"

layout(set = 0, binding = 0) uniform sampler2D sums;

layout(location = 0) out vec4 statistics;

// Largest square, so that sums of squares are finite.
const float LARGEST = 1e34;

void main() {
    vec4 sum = texelFetch(sums, ivec2(gl_FragCoord.xy) + push.offset, 0);
    float y = sum.y * push.inverse_scale;
    statistics = vec4(y, sum.w > 0.0 ? min(y * (y / sum.w), LARGEST) : 0.0, 0.0, 0.0);
}
