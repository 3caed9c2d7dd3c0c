#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/layers.glsl"

// The two images of sums become one image of radiance: blur by sample count and variance, normalise, add (paper §4.3).

#define TEXELS sampler2D
#include "include/reconstruct.glsl"
#include "include/lod.glsl"

layout(location = 0) out vec4 xyz;

vec4 texel_at(sampler2D image, Level level, ivec2 at) {
    return texelFetch(image, level.origin + clamp(at, ivec2(0), level.size - 1), level.mip);
}

// Smallest weight, as a part of the bilinear one, at which the cubic is taken: negative lobes beside an empty region
// would otherwise divide by nearly nothing.
const float CATMULL_ROM_MIN_WEIGHT = 0.05;

vec4 sums_at(sampler2D image, sampler2D near, sampler2D far, float lod, const uint extent, vec2 place) {
    ivec2 texel = ivec2(place);
    if (extent == FILTERED) {
        return filtered_at(image, place);
    }
    if (KIND == NONE || extent == TEXEL) {
        return texelFetch(image, texel, 0);
    }
    Levels at = levels_at(image, near, far, lod, place);
    if (KIND == GAUSSIAN) {
        vec4 sums = gaussian(near, far, at, extent);
        if (MASKING) {
            sums = lod <= -1.0 ? texelFetch(image, texel, 0) : sums;
        }
        return sums;
    }
    float f = max(at.f, 0.0);
    vec4 linear = mix(bilinear(near, at.p_near, at.near), bilinear(far, at.p_far, at.far), f);
    if (KIND == MIPMAP) {
        return linear;
    }
    vec4 sums = mix(catmull_rom(near, at.p_near, at.near), catmull_rom(far, at.p_far, at.far), f);
    return sums.w > CATMULL_ROM_MIN_WEIGHT * linear.w ? sums : linear;
}

void main() {
    vec2 place = place_of(gl_FragCoord.xy);
    vec4 of_camera = vec4(0.0);
    vec4 of_light = vec4(0.0);
    if (CAMERA != ABSENT) {
        float lod = push.lod.x;
        if (MASKING && CAMERA != TEXEL) {
            lod = masked_lod(camera, camera_variance, place, lod, push.variance_lod.x, 0.0);
        }
        of_camera = sums_at(camera, camera_near, camera_far, lod, CAMERA, place);
    }
    if (LIGHT != ABSENT) {
        float lod = push.lod.y;
        if (MASKING && LIGHT != TEXEL && LIGHT != FILTERED) {
            lod = masked_lod(light, light_variance, place, lod, push.variance_lod.y, 1.0);
        }
        of_light = sums_at(light, light_near, light_far, lod, LIGHT, place);
    }
    xyz = vec4(radiance(of_camera, of_light), 1.0);
}
