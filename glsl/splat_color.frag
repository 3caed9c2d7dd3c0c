#version 460
#extension GL_GOOGLE_include_directive : require

// f · [x, y, z, |w|], added to the batch image by the blender.

#include "include/filter.glsl"

layout(location = 0) flat in vec2 position;
layout(location = 1) flat in vec4 value;
layout(location = 0) out vec4 sum;

void main() {
    sum = value * splat_weight(gl_FragCoord.xy - position);
}
