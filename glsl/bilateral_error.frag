#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/layers.glsl"

// Squared standard error of a texel's displayed value, in units of the luminance scale. Reference: src/client/reference/bilateral.rs.

#define BILATERAL_PUSH
#include "include/layout.glsl"
#include "include/gather.glsl"
#include "include/lod.glsl"

// Whether it is the light stream, whose sums are shown.
layout(constant_id = 0) const bool SUMMED = false;

layout(set = 0, binding = 0) uniform sampler2D color;
layout(set = 0, binding = 1) uniform sampler2D variance;

layout(location = 0) out float squared_error;

void main() {
    vec2 texel = gl_FragCoord.xy;
    float r = relative_variance(color, variance, texel, 0.0, push.variance_lod, SUMMED ? 1.0 : 0.0);
    vec2 yw = trilinear(color, texel, push.variance_lod).yw;
    float y = yw.y > 0.0 ? yw.x / yw.y * push.inverse_scale : 0.0;
    squared_error = r * (y * y + DARK * DARK) * (SUMMED ? yw.y * yw.y : 1.0);
}
