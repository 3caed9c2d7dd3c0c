#version 460
#extension GL_GOOGLE_include_directive : require

// f · w² (Y - m0)(Y - m1), in units of the squared luminance scale, added to the batch image by the blender.
// m0 and m1 are the texel's mean before and after this batch; the paper's own form has m1 twice.

#define SPLAT_PUSH
#include "include/layout.glsl"
#include "include/slot.glsl"

layout(constant_id = 2) const bool PAPER_FORM = false;

layout(set = 0, binding = 0) uniform sampler2D means;

layout(location = 0) flat in vec2 position;
layout(location = 1) flat in vec4 value;
layout(location = 2) flat in float first_row;
layout(location = 0) out float sum;

void main() {
    vec2 texel = slot_texel(first_row);
    vec4 mean = texelFetch(means, clamp(ivec2(texel), ivec2(0), ivec2(push.target) - 1), 0);
    precise float after = (value.x - mean.z) - mean.w;
    precise float before = (value.x - mean.x) - mean.y;
    float w = value.y;
    sum = slot_weight(texel, position) * (w * (PAPER_FORM ? after : before)) * (w * after);
}
