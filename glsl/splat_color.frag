#version 460
#extension GL_GOOGLE_include_directive : require

// f · [x, y, z, |w|], added to the batch image by the blender.

#define SPLAT_PUSH
#include "include/layout.glsl"
#include "include/slot.glsl"

layout(location = 0) flat in vec2 position;
layout(location = 1) flat in vec4 value;
layout(location = 2) flat in float first_row;
layout(location = 0) out vec4 sum;

void main() {
    sum = value * slot_weight(slot_texel(first_row), position);
}
