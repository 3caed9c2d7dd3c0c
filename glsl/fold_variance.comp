#version 460
#extension GL_GOOGLE_include_directive : require

// Adds a batch of squared deviations to its two-float sums, in place.

#include "include/two_float.glsl"

// Number of copies of the film in the batch image, one below the other.
layout(constant_id = 0) const uint SLOTS = 1u;

layout(local_size_x = 16, local_size_y = 8) in;

layout(set = 0, binding = 0, r32f) uniform image2D sums;
layout(set = 0, binding = 1, r32f) uniform image2D rests;
layout(set = 0, binding = 2, r32f) readonly uniform image2D batch;

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(sums);
    if (any(greaterThanEqual(at, size))) {
        return;
    }
    float hi = imageLoad(sums, at).r;
    float lo = imageLoad(rests, at).r;
    for (uint slot = 0u; slot < SLOTS; ++slot) {
        two_float_add(hi, lo, imageLoad(batch, ivec2(at.x, at.y + int(slot) * size.y)).r);
    }
    imageStore(sums, at, vec4(hi));
    imageStore(rests, at, vec4(lo));
}
