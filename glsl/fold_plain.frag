#version 460
#extension GL_GOOGLE_include_directive : require

// Adds a batch image to sums of one float each, to show the effect of the second float of fold.frag.

#define FOLD_PUSH
#include "include/layout.glsl"

// Number of copies of the film in the batch image, one below the other.
layout(constant_id = 0) const uint SLOTS = 1u;
// Whether there is a second attachment for the means.
layout(constant_id = 1) const bool MEANS = true;

layout(set = 0, binding = 0) uniform sampler2D old_sums;
layout(set = 0, binding = 1) uniform sampler2D batch;

layout(location = 0) out vec4 new_sums;
// Mean luminance in units of the scale before (x) and after (z); the rest, of a second float, is 0.
layout(location = 1) out vec4 means;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 before = texelFetch(old_sums, at, 0);
    vec4 after = before;
    int rows = textureSize(old_sums, 0).y;
    for (uint slot = 0u; slot < SLOTS; ++slot) {
        after += texelFetch(batch, ivec2(at.x, at.y + int(slot) * rows), 0);
    }
    new_sums = after;
    if (MEANS) {
        float mean = after.w > 0.0 ? after.y / after.w * push.inverse_scale : 0.0;
        means = vec4(before.w > 0.0 ? before.y / before.w * push.inverse_scale : mean, 0.0, mean, 0.0);
    }
}
