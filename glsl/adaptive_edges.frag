#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/layers.glsl"

// Adaptive filtering: how significant the gradient of luminance is at every texel of a level, in squared standard deviations.

#include "include/adaptive.glsl"

layout(set = 0, binding = 0) uniform sampler2D statistics;

layout(location = 0) out float edges;

vec2 texel(ivec2 at) {
    return texelFetch(statistics, clamp(at, ivec2(0), push.extent - 1), 0).xy;
}

float along(ivec2 at, ivec2 step, ivec2 across) {
    float area = exp2(2.0 * float(push.level));
    float gradient = 0.0;
    float squares = 0.0;
    for (int k = -1; k <= 1; ++k) {
        vec2 before = texel(at - step + k * across);
        vec2 after = texel(at + step + k * across);
        float weight = float(2 - abs(k));
        gradient += weight * (after.x - before.x);
        squares += weight * weight * (before.y + after.y);
    }
    return squares > 0.0 ? gradient * (gradient / squares) * area : 0.0;
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    edges = along(at, ivec2(1, 0), ivec2(0, 1)) + along(at, ivec2(0, 1), ivec2(1, 0));
}
