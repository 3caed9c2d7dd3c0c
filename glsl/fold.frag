#version 460
#extension GL_GOOGLE_include_directive : require

// Adds a batch image to the two-float accumulator and leaves the mean luminance before and after it, if the variance needs it.

#define FOLD_PUSH
#include "include/layout.glsl"
#include "include/two_float.glsl"

// Number of copies of the film in the batch image, one below the other.
layout(constant_id = 0) const uint SLOTS = 1u;
// Whether there is a third attachment for the means.
layout(constant_id = 1) const bool MEANS = true;

layout(set = 0, binding = 0) uniform sampler2D old_hi;
layout(set = 0, binding = 1) uniform sampler2D old_lo;
layout(set = 0, binding = 2) uniform sampler2D batch;

layout(location = 0) out vec4 new_hi;
layout(location = 1) out vec4 new_lo;
// Mean luminance in units of the scale, as two floats each: before (xy) and after (zw). The second float keeps
// deviations right where the mean is 10^6 times the deviation.
layout(location = 2) out vec4 means;

// x, y: sum / weight as two floats.
vec2 two_float_mean(vec4 hi, vec4 lo) {
    float mean = hi.y / hi.w;
    float rest = (product_error(hi.y, mean, hi.w) + (lo.y - mean * lo.w)) / hi.w;
    // False for NaN: near the largest float the product cannot be split.
    rest = abs(rest) <= abs(mean) ? rest : 0.0;
    return vec2(mean, rest) * push.inverse_scale;
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 hi = texelFetch(old_hi, at, 0);
    vec4 lo = texelFetch(old_lo, at, 0);
    bool was_empty = !(hi.w > 0.0);
    vec2 before = two_float_mean(hi, lo);
    int rows = textureSize(old_hi, 0).y;
    for (uint slot = 0u; slot < SLOTS; ++slot) {
        two_float_add(hi, lo, texelFetch(batch, ivec2(at.x, at.y + int(slot) * rows), 0));
    }
    new_hi = hi;
    new_lo = lo;
    if (MEANS) {
        vec2 after = hi.w > 0.0 ? two_float_mean(hi, lo) : vec2(0.0);
        // Without earlier samples the sum of squares starts at the new mean.
        means = vec4(was_empty ? after : before, after);
    }
}
