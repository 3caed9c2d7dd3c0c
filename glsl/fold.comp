#version 460
#extension GL_GOOGLE_include_directive : require

// Adds a batch image to the sums, in place, and leaves the mean luminance before and after it, if the variance needs it. Every texel
// is read and written by one invocation alone.

layout(push_constant) uniform FoldPush {
    float inverse_scale;  // 1 / luminance scale, a power of two
} push;

#include "include/two_float.glsl"

// Number of copies of the film in the batch image, one below the other.
layout(constant_id = 0) const uint SLOTS = 1u;
// Whether the means are kept.
layout(constant_id = 1) const bool MEANS = true;
// Whether sums have a second float; without it they show what it is for.
layout(constant_id = 2) const bool TWO_FLOAT = true;

layout(local_size_x = 16, local_size_y = 8) in;

layout(set = 0, binding = 0, rgba32f) uniform image2D sums;
// The rests that rounding left out.
layout(set = 0, binding = 1, rgba32f) uniform image2D rests;
layout(set = 0, binding = 2, rgba32f) readonly uniform image2D batch;
// Mean luminance in units of the scale, as two floats each: before (xy) and after (zw). The second float keeps
// deviations right where the mean is 10^6 times the deviation.
layout(set = 0, binding = 3, rgba32f) writeonly uniform image2D means;

// x, y: sum / weight as two floats.
vec2 mean_luminance(vec4 hi, vec4 lo) {
    float mean = hi.y / hi.w;
    if (!TWO_FLOAT) {
        return vec2(mean * push.inverse_scale, 0.0);
    }
    float rest = (product_error(hi.y, mean, hi.w) + (lo.y - mean * lo.w)) / hi.w;
    // False for NaN: near the largest float the product cannot be split.
    rest = abs(rest) <= abs(mean) ? rest : 0.0;
    return vec2(mean, rest) * push.inverse_scale;
}

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(sums);
    if (any(greaterThanEqual(at, size))) {
        return;
    }
    vec4 hi = imageLoad(sums, at);
    vec4 lo = TWO_FLOAT ? imageLoad(rests, at) : vec4(0.0);
    bool was_empty = !(hi.w > 0.0);
    vec2 before = mean_luminance(hi, lo);
    for (uint slot = 0u; slot < SLOTS; ++slot) {
        vec4 added = imageLoad(batch, ivec2(at.x, at.y + int(slot) * size.y));
        if (TWO_FLOAT) {
            two_float_add(hi, lo, added);
        } else {
            hi += added;
        }
    }
    imageStore(sums, at, hi);
    if (TWO_FLOAT) {
        imageStore(rests, at, lo);
    }
    if (MEANS) {
        vec2 after = hi.w > 0.0 ? mean_luminance(hi, lo) : vec2(0.0);
        // Without earlier samples the sum of squares starts at the new mean.
        imageStore(means, at, vec4(was_empty ? after : before, after));
    }
}
