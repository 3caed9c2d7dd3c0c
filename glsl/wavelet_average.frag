#version 460
#extension GL_GOOGLE_include_directive : require

// Means of signal and noise of a band over the pixel and its neighbours.

#include "include/wavelet.glsl"
#include "include/wavelet_mean.glsl"

layout(set = 0, binding = 0) uniform sampler2D power;
layout(set = 0, binding = 1) uniform sampler2D weights;

layout(location = 0) out vec2 mean;

void main() {
    mean = mean_power(power, weights, ivec2(gl_FragCoord.xy));
}
