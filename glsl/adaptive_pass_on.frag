#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/layers.glsl"

// Adaptive filtering: the light that comes to the next coarser level, which is what the finer one has not kept.

#include "include/adaptive.glsl"
#include "include/polyphase.glsl"

layout(set = 0, binding = 0) uniform sampler2D light;
layout(set = 0, binding = 1) uniform sampler2D kept;

layout(location = 0) out vec4 passed;

void main() {
    ivec2 i = ivec2(gl_FragCoord.xy);
    vec3 wx = axis_weights(TAPS_X, push.extent.x, i.x);
    vec3 wy = axis_weights(TAPS_Y, push.extent.y, i.y);
    passed = vec4(0.0);
    for (int y = 0; y < TAPS_Y; ++y) {
        vec4 row = vec4(0.0);
        for (int x = 0; x < TAPS_X; ++x) {
            ivec2 at = 2 * i + ivec2(x, y);
            row += wx[x] * (texelFetch(light, at + push.offset, 0) - texelFetch(kept, at, 0));
        }
        passed += wy[y] * row;
    }
}
