#version 460
#extension GL_GOOGLE_include_directive : require
#define COMPUTE
#include "include/layers.glsl"

// Glare, first pass: two rows of one channel, one as real and the other as imaginary part, become their frequencies.

#define GLARE_PUSH
#include "include/layout.glsl"
#include "include/fourier.glsl"

layout(set = 0, binding = 1, rgba32f) readonly uniform image2D picture;
layout(std430, set = 0, binding = 2) readonly buffer Gain { float gain[]; };
layout(std430, set = 0, binding = 3) writeonly buffer Work { vec4 work[]; };

const float LARGEST = 3.4028234e38;
const float SCALE = 9.313225746154785e-10; // 2^-30: no sum overflows

float light(uint x, uint y) {
    if (x >= push.extent.x || y >= push.extent.y) {
        return 0.0;
    }
    float value = imageLoad(picture, ivec2(x, y))[push.channel];
    value = isnan(value) ? 0.0 : clamp(value, -LARGEST, LARGEST);
    uvec2 at = min(uvec2(x, y), push.extent - 1u - uvec2(x, y));
    uint stride = (push.extent.x + 1u) / 2u;
    return value * SCALE * gain[(at.y * stride + at.x) * 3u + push.channel];
}

void main() {
    uint pair = gl_WorkGroupID.x;
    uint pairs = (push.extent.y + 1u) / 2u;
    uint layer_start = uint(LAYER) * (HALF + 1u) * pairs;
    for (uint odd = 0u; odd < 2u; odd++) {
        for (uint x = gl_LocalInvocationIndex; x < HALF; x += THREADS) {
            vec2 two = vec2(light(x, 2u * pair), light(x, 2u * pair + 1u));
            line[x] = odd == 0u ? two : times(two, table[x]);
        }
        forward();
        for (uint k = gl_LocalInvocationIndex; 2u * k + odd <= HALF; k += THREADS) {
            if (k >= HALF) break;
            uint mirror = odd == 0u ? (HALF - k) % HALF : HALF - 1u - k;
            vec2 a = line[place(k)];
            vec2 b = conjugate(line[place(mirror)]);
            work[layer_start + (2u * k + odd) * pairs + pair] = 0.5 * vec4(a + b, turned(a - b, false));
        }
        barrier();
    }
}
