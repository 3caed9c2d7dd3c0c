#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/layers.glsl"

// Adaptive filtering: what coarser levels have kept is added to what this level has.

#include "include/adaptive.glsl"

layout(set = 0, binding = 0) uniform sampler2D coarser;

layout(location = 0) out vec4 light;

void main() {
    light = interpolated(coarser, ivec2(gl_FragCoord.xy));
}
