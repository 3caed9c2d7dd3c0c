#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/layers.glsl"

// XYZ becomes an encoded picture: tone curve, matrix P, constant-luminance desaturation, transfer (paper §4.3), dither.
// Specialization constants, from src/client/effects.rs, compile out what is off.

layout(push_constant) uniform TonemapPush {
    vec4 red;             // rows of P, XYZ to linear RGB; w unused
    vec4 green;
    vec4 blue;
    float exposure;       // B
    float contrast;       // C
    float inverse_gamma;  // 1 / G
    float padding;
} push;

#include "include/curves.glsl"
#include "include/color.glsl"
#include "include/dither.glsl"
#include "include/zones.glsl"

layout(set = 0, binding = 0) uniform sampler2D radiance;
// The display's transfer, at squares of i / (size - 1).
layout(set = 0, binding = 1) uniform sampler2D transfer;
layout(set = 0, binding = 2) uniform sampler2D mask;

layout(location = 0) out vec4 encoded;

const uint SDR = 0u;
const uint SCRGB = 1u;
const uint HDR10 = 2u;

// Picture pixels per pixel of `radiance`, along each axis.
layout(constant_id = 0) const uint DETAIL = 1u;
// What is shown of `radiance`: the picture; a grey without a curve; exposure zones in false colours; the picture with marks.
const uint PICTURE = 0u;
const uint GREY = 1u;
const uint FALSE_COLOR = 2u;
const uint MARKED = 3u;
layout(constant_id = 1) const uint VIEW = PICTURE;
layout(constant_id = 2) const uint CURVE = PAPER;
layout(constant_id = 3) const uint OUTPUT = SDR;
// Whether the transfer is the table's, not a power.
layout(constant_id = 4) const bool TABLE = false;
layout(constant_id = 5) const uint DITHER = UNDITHERED;
// The largest luminance of a wide-range output, 1 being diffuse white.
layout(constant_id = 6) const float CEILING = PEAK / DIFFUSE_WHITE;

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

// The transfer's table, linearly interpolated.
vec3 tabulated(vec3 c) {
    int last = textureSize(transfer, 0).x - 1;
    vec3 at = sqrt(c) * float(last);
    vec3 encoded;
    for (int k = 0; k < 3; ++k) {
        int i = clamp(int(at[k]), 0, last - 1);
        float a = texelFetch(transfer, ivec2(i, 0), 0)[k];
        encoded[k] = mix(a, texelFetch(transfer, ivec2(i + 1, 0), 0)[k], at[k] - float(i));
    }
    return encoded;
}

void main() {
    vec3 here = radiance_here();
    float ceiling = OUTPUT == SDR ? 1.0 : CEILING;
    vec3 rgb;
    if (VIEW == GREY) {
        rgb = vec3(clamp(here.y, 0.0, 1.0));
    } else if (VIEW == FALSE_COLOR) {
        rgb = zone_color(push.exposure * here.y);
    } else {
        rgb = display_linear(here, CURVE, ceiling);
        if (VIEW == MARKED) {
            rgb = with_marks(rgb, ceiling, ivec2(gl_FragCoord.xy));
        }
    }
    if (OUTPUT == SCRGB) {
        encoded = vec4(rgb * (DIFFUSE_WHITE / 80.0), 1.0);
        return;
    }
    float steps = 255.0;
    if (OUTPUT == HDR10) {
        rgb = pq(rgb * (DIFFUSE_WHITE / 10000.0));
        steps = 1023.0;
    } else {
        rgb = TABLE ? tabulated(rgb) : pow(rgb, vec3(push.inverse_gamma));
    }
    encoded = vec4(floor(rgb * steps + thresholds(DITHER, mask, ivec2(gl_FragCoord.xy))) / steps, 1.0);
}
