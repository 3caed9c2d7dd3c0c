#version 460
#extension GL_GOOGLE_include_directive : require

// Adds a batch of squared deviations to its two-float accumulator.

#include "include/two_float.glsl"

// Number of copies of the film in the batch image, one below the other.
layout(constant_id = 0) const uint SLOTS = 1u;

layout(set = 0, binding = 0) uniform sampler2D old_hi;
layout(set = 0, binding = 1) uniform sampler2D old_lo;
layout(set = 0, binding = 2) uniform sampler2D batch;

layout(location = 0) out float new_hi;
layout(location = 1) out float new_lo;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    float hi = texelFetch(old_hi, at, 0).r;
    float lo = texelFetch(old_lo, at, 0).r;
    int rows = textureSize(old_hi, 0).y;
    for (uint slot = 0u; slot < SLOTS; ++slot) {
        two_float_add(hi, lo, texelFetch(batch, ivec2(at.x, at.y + int(slot) * rows), 0).r);
    }
    new_hi = hi;
    new_lo = lo;
}
