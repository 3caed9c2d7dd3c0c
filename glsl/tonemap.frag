#version 460
#extension GL_GOOGLE_include_directive : require

// XYZ becomes an encoded picture: tone curve on Y, matrix P, constant-luminance desaturation, gamma (paper §4.3).

#define TONEMAP_PUSH
#include "include/layout.glsl"
#include "include/color.glsl"

layout(set = 0, binding = 0) uniform sampler2D radiance;

layout(location = 0) out vec4 encoded;

void main() {
    vec3 xyz = texelFetch(radiance, ivec2(gl_FragCoord.xy), 0).xyz;
    encoded = vec4(floor(encode(xyz) * 255.0 + 0.5) / 255.0, 1.0);
}
