#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/layers.glsl"

// One level of the mip chain.

#include "include/polyphase.glsl"

layout(push_constant) uniform DownsamplePush {
    ivec2 source;         // extent of the finer level, texels
} push;

// Whether a second image, the variance, is averaged alike.
layout(constant_id = 2) const bool VARIANCE = false;

layout(set = 0, binding = 0) uniform sampler2D color;
layout(set = 0, binding = 1) uniform sampler2D variance;

layout(location = 0) out vec4 out_color;
layout(location = 1) out float out_variance;

vec4 polyphase(sampler2D image, ivec2 at, vec3 wx, vec3 wy) {
    vec4 sum = vec4(0.0);
    for (int y = 0; y < TAPS_Y; ++y) {
        vec4 row = vec4(0.0);
        for (int x = 0; x < TAPS_X; ++x) {
            row += wx[x] * texelFetch(image, at + ivec2(x, y), 0);
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
    if (TAPS_X == 2 && TAPS_Y == 2) {
        out_color = average(color, at);
        if (VARIANCE) {
            out_variance = average(variance, at).r;
        }
    } else {
        vec3 wx = axis_weights(TAPS_X, push.source.x, i.x);
        vec3 wy = axis_weights(TAPS_Y, push.source.y, i.y);
        out_color = polyphase(color, at, wx, wy);
        if (VARIANCE) {
            out_variance = polyphase(variance, at, wx, wy).r;
        }
    }
}
