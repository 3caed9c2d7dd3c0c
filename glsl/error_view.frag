#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/layers.glsl"

// The relative standard error of one stream as grey: black is exact, white is 100 % (the paper's Figure 5, right).

#define RECONSTRUCT_PUSH
#include "include/layout.glsl"
#include "include/gather.glsl"
#include "include/lod.glsl"

// Whether it is the light stream, whose sums are shown: the number of samples is random too.
layout(constant_id = 0) const bool SUMMED = false;

layout(set = 0, binding = 0) uniform sampler2D color;
layout(set = 0, binding = 1) uniform sampler2D variance;

layout(location = 0) out vec4 grey;

void main() {
    vec2 texel = gl_FragCoord.xy * push.texels + push.pad;
    float lod = SUMMED ? push.lod.y : push.lod.x;
    float level = SUMMED ? push.variance_lod.y : push.variance_lod.x;
    float error = relative_variance(color, variance, texel, lod, level, SUMMED ? 1.0 : 0.0);
    grey = vec4(vec3(min(sqrt(error), 1.0)), 1.0);
}
