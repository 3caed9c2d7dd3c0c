#version 460
#extension GL_GOOGLE_include_directive : require

// The two images of sums become one image of radiance: blur by sample count and variance, normalise, add (paper §4.3).
// What is not wanted is compiled out: a stream without samples, noise masking, the second level.

#define RECONSTRUCT_PUSH
#include "include/layout.glsl"
#include "include/lod.glsl"
#include "include/gather.glsl"

const uint GAUSSIAN = 0u;
const uint CATMULL_ROM = 1u;
const uint MIPMAP = 2u;
const uint NONE = 3u;

// How much of the kernel a stream needs; the host knows the level of detail unless noise is masked.
const uint ABSENT = 0u;      // no samples yet
const uint TEXEL = 1u;       // level of detail <= -1: the blur is below one texel
const uint ONE_LEVEL = 2u;   // between -1 and 0
const uint TWO_LEVELS = 3u;  // any, also per pixel

layout(constant_id = 0) const uint KIND = GAUSSIAN;
layout(constant_id = 1) const bool MASKING = false;
layout(constant_id = 2) const uint CAMERA = TWO_LEVELS;
layout(constant_id = 3) const uint LIGHT = ABSENT;
// Taps on either side of the middle one, at the coarser (or only) level: 1 where the others weigh below 1e-5.
layout(constant_id = 4) const int CAMERA_RADIUS = 2;
layout(constant_id = 5) const int LIGHT_RADIUS = 2;

layout(set = 0, binding = 0) uniform sampler2D camera;
layout(set = 0, binding = 1) uniform sampler2D camera_variance;
layout(set = 0, binding = 2) uniform sampler2D light;
layout(set = 0, binding = 3) uniform sampler2D light_variance;

layout(location = 0) out vec4 xyz;

vec4 gaussian(sampler2D image, vec2 uv, float lod, const uint extent, const int radius) {
    int level = int(max(floor(lod), 0.0));
    float f = lod - float(level);  // negative below level 0: the kernel narrows
    if (extent == ONE_LEVEL) {
        return windowed_gaussian(image, uv, 0, exp2(2.0 * (1.0 - f)), radius);
    }
    float g = max(f, 0.0);
    int coarse = min(level + 1, int(push.max_level));
    vec4 a = windowed_gaussian(image, uv, level, exp2(2.0 * (1.0 - f)), 2);
    vec4 b = windowed_gaussian(image, uv, coarse, exp2(2.0 * (2.0 - g)), radius);
    return mix(a, b, g);
}

// Smallest weight, as a part of the bilinear one, at which the cubic is taken.
const float CATMULL_ROM_MIN_WEIGHT = 0.05;

vec4 cubic(sampler2D image, vec2 uv, float lod) {
    float above = max(lod, 0.0);
    int level = int(above);
    int coarse = min(level + 1, int(push.max_level));
    vec4 sums = mix(catmull_rom(image, uv, level), catmull_rom(image, uv, coarse), above - float(level));
    // Negative lobes beside an empty region would otherwise divide by nearly nothing.
    vec4 linear = textureLod(image, uv, above);
    return sums.w > CATMULL_ROM_MIN_WEIGHT * linear.w ? sums : linear;
}

vec4 sums_at(sampler2D image, vec2 uv, float lod, const uint extent, const int radius) {
    ivec2 texel = ivec2(gl_FragCoord.xy + push.pad);
    if (KIND == NONE || extent == TEXEL) {
        return texelFetch(image, texel, 0);
    }
    if (KIND == MIPMAP) {
        return textureLod(image, uv, max(lod, 0.0));
    }
    if (KIND == CATMULL_ROM) {
        return cubic(image, uv, lod);
    }
    vec4 sums = gaussian(image, uv, lod, extent, radius);
    if (MASKING) {
        sums = lod <= -1.0 ? texelFetch(image, texel, 0) : sums;
    }
    return sums;
}

void main() {
    vec2 uv = (gl_FragCoord.xy + push.pad) * push.inverse_target;
    vec3 total = vec3(0.0);
    if (CAMERA != ABSENT) {
        float lod = push.lod.x;
        if (MASKING) {
            lod = masked_lod(camera, camera_variance, uv, lod, push.variance_lod.x);
        }
        vec4 sums = sums_at(camera, uv, lod, CAMERA, CAMERA_RADIUS);
        total += sums.w > 0.0 ? sums.xyz / sums.w : vec3(0.0);
    }
    if (LIGHT != ABSENT) {
        float lod = push.lod.y;
        if (MASKING) {
            lod = masked_lod(light, light_variance, uv, lod, push.variance_lod.y);
        }
        total += sums_at(light, uv, lod, LIGHT, LIGHT_RADIUS).xyz * push.light_scale;
    }
    xyz = vec4(total, 1.0);
}
