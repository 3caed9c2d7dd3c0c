#version 460
#extension GL_GOOGLE_include_directive : require

// XYZ becomes an encoded picture: tone curve on Y, matrix P, constant-luminance desaturation, gamma (paper §4.3).

#define TONEMAP_PUSH
#include "include/layout.glsl"
#include "include/color.glsl"

layout(set = 0, binding = 0) uniform sampler2D radiance;

layout(location = 0) out vec4 encoded;

// Picture pixels per pixel of `radiance`, along each axis.
layout(constant_id = 0) const uint DETAIL = 1u;

// Radiance of this pixel: as it is, or interpolated between the four nearest of a coarser picture.
vec3 radiance_here() {
    if (DETAIL == 1u) {
        return texelFetch(radiance, ivec2(gl_FragCoord.xy), 0).xyz;
    }
    ivec2 last = textureSize(radiance, 0) - 1;
    vec2 p = clamp(gl_FragCoord.xy / float(DETAIL) - 0.5, vec2(0.0), vec2(last));
    ivec2 a = ivec2(p);
    ivec2 b = min(a + 1, last);
    vec2 f = p - vec2(a);
    vec3 top = mix(texelFetch(radiance, a, 0).xyz, texelFetch(radiance, ivec2(b.x, a.y), 0).xyz, f.x);
    vec3 bottom = mix(texelFetch(radiance, ivec2(a.x, b.y), 0).xyz, texelFetch(radiance, b, 0).xyz, f.x);
    return mix(top, bottom, f.y);
}

void main() {
    vec3 xyz = radiance_here();
    encoded = vec4(floor(encode(xyz) * 255.0 + 0.5) / 255.0, 1.0);
}
