#version 460
#extension GL_GOOGLE_include_directive : require
#define COMPUTE
#include "include/layers.glsl"

// Glare, second pass: one column of row frequencies is convolved with the kernel, by both halves of its transform.

#define GLARE_PUSH
#include "include/layout.glsl"
#include "include/fourier.glsl"

layout(std430, set = 0, binding = 1) readonly buffer Kernel { float kernel[]; };
layout(std430, set = 0, binding = 2) buffer Work { vec2 work[]; };

void convolve(uint odd) {
    forward();
    uint first = gl_WorkGroupID.x * (HALF + 1u);
    for (uint k = gl_LocalInvocationIndex; k < HALF; k += THREADS) {
        uint frequency = 2u * k + odd;
        line[place(k)] *= kernel[first + min(frequency, 2u * HALF - frequency)];
    }
    backward();
}

void main() {
    uint height = push.extent.y;
    // Columns of a layer, and then those of the next one.
    uint column = uint(LAYER) * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint first = column * ((height + 1u) / 2u * 2u);
    for (uint y = gl_LocalInvocationIndex; y < HALF; y += THREADS) {
        line[y] = y < height ? work[first + y] : vec2(0.0);
    }
    convolve(0u);
    for (uint y = gl_LocalInvocationIndex; y < HALF; y += THREADS) {
        vec2 odd = vec2(0.0);
        if (y < height) {
            odd = times(work[first + y], table[y]);
            work[first + y] = line[y];
        }
        line[y] = odd;
    }
    convolve(1u);
    for (uint y = gl_LocalInvocationIndex; y < height; y += THREADS) {
        work[first + y] += times(line[y], conjugate(table[y]));
    }
}
