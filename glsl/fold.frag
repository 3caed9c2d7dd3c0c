#version 460
#extension GL_GOOGLE_include_directive : require

// Adds a batch image to the two-float accumulator and leaves the mean luminance before and after it.

#define FOLD_PUSH
#include "include/layout.glsl"
#include "include/two_float.glsl"

layout(set = 0, binding = 0) uniform sampler2D old_hi;
layout(set = 0, binding = 1) uniform sampler2D old_lo;
layout(set = 0, binding = 2) uniform sampler2D batch;

layout(location = 0) out vec4 new_hi;
layout(location = 1) out vec4 new_lo;
layout(location = 2) out vec2 means;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 hi = texelFetch(old_hi, at, 0);
    vec4 lo = texelFetch(old_lo, at, 0);
    vec2 before = hi.yw;
    two_float_add(hi, lo, texelFetch(batch, at, 0));
    new_hi = hi;
    new_lo = lo;
    float mean = hi.w > 0.0 ? hi.y / hi.w * push.inverse_scale : 0.0;
    // Without earlier samples the sum of squares starts at the new mean.
    float mean_before = before.y > 0.0 ? before.x / before.y * push.inverse_scale : mean;
    means = vec2(mean_before, mean);
}
