#version 460
#extension GL_GOOGLE_include_directive : require
#define COMPUTE
#include "include/layers.glsl"

// Glare, third pass: two rows of all channels come back from their frequencies into the picture.

#define GLARE_PUSH
#include "include/layout.glsl"
#include "include/fourier.glsl"

layout(set = 0, binding = 1, rgba32f) writeonly uniform image2D picture;
layout(std430, set = 0, binding = 2) readonly buffer WorkX { vec4 work_x[]; };
layout(std430, set = 0, binding = 3) readonly buffer WorkY { vec4 work_y[]; };
layout(std430, set = 0, binding = 4) readonly buffer WorkZ { vec4 work_z[]; };

const float LARGEST = 3.4028234e38;
const float UNSCALE = 1073741824.0; // 2^30
const uint KEPT = (HALF + THREADS - 1u) / THREADS;

vec4 work(uint channel, uint at) {
    return channel == 0u ? work_x[at] : channel == 1u ? work_y[at] : work_z[at];
}

void store(uint x, uint y, vec3 xyz) {
    if (y < push.extent.y) {
        imageStore(picture, ivec2(x, y), vec4(clamp(xyz * UNSCALE, -LARGEST, LARGEST), 1.0));
    }
}

void main() {
    uint pair = gl_WorkGroupID.x;
    uint pairs = (push.extent.y + 1u) / 2u;
    uint layer_start = uint(LAYER) * (HALF + 1u) * pairs;
    vec3 upper[KEPT];
    vec3 lower[KEPT];
    for (uint i = 0u; i < KEPT; i++) {
        upper[i] = vec3(0.0);
        lower[i] = vec3(0.0);
    }
    for (uint step = 0u; step < 6u; step++) {
        uint channel = step >> 1;
        uint odd = step & 1u;
        for (uint k = gl_LocalInvocationIndex; k < HALF; k += THREADS) {
            uint frequency = 2u * k + odd;
            bool mirrored = frequency > HALF;
            vec4 two = work(channel, layer_start + (mirrored ? 2u * HALF - frequency : frequency) * pairs + pair);
            two = mirrored ? two * vec4(1.0, -1.0, 1.0, -1.0) : two;
            line[place(k)] = two.xy + vec2(-two.w, two.z);
        }
        backward();
        vec3 axis = vec3(channel == 0u, channel == 1u, channel == 2u);
        for (uint i = 0u; i < KEPT; i++) {
            uint x = i * THREADS + gl_LocalInvocationIndex;
            if (x < push.extent.x) {
                vec2 two = odd == 0u ? line[x] : times(line[x], conjugate(table[x]));
                upper[i] += axis * two.x;
                lower[i] += axis * two.y;
            }
        }
        barrier();
    }
    for (uint i = 0u; i < KEPT; i++) {
        uint x = i * THREADS + gl_LocalInvocationIndex;
        if (x < push.extent.x) {
            store(x, 2u * pair, upper[i]);
            store(x, 2u * pair + 1u, lower[i]);
        }
    }
}
