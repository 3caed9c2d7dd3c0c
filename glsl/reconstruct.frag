#version 460
#extension GL_GOOGLE_include_directive : require

// The two images of sums become one image of radiance: blur by sample count and variance, normalise, add (paper §4.3).
// Specialization constants compile out what is off: a stream without samples, noise masking, the second level.

#define RECONSTRUCT_PUSH
#include "include/layout.glsl"
#include "include/gather.glsl"
#include "include/lod.glsl"

const uint GAUSSIAN = 0u;
const uint CATMULL_ROM = 1u;
const uint MIPMAP = 2u;
const uint NONE = 3u;

// The part of the kernel that a stream needs; the host knows the level of detail unless noise is masked.
const uint ABSENT = 0u;      // no samples yet
const uint TEXEL = 1u;       // level of detail <= -1: the blur is below one texel, or was done before
const uint ONE_LEVEL = 2u;   // between -1 and 0
const uint TWO_LEVELS = 3u;  // any, also per pixel

layout(constant_id = 0) const uint KIND = GAUSSIAN;
layout(constant_id = 1) const bool MASKING = false;
layout(constant_id = 2) const uint CAMERA = TWO_LEVELS;
layout(constant_id = 3) const uint LIGHT = ABSENT;
// Support of the Gaussian: 2R texels along each axis, and E, 0 for no window.
layout(constant_id = 4) const int TAPS = 5;
layout(constant_id = 5) const int EXPONENT = 8;
// Whether levels that differ from pixel to pixel are read from an atlas.
layout(constant_id = 6) const bool ATLAS = true;

#include "include/truncated.glsl"

// All levels.
layout(set = 0, binding = 0) uniform sampler2D camera;
layout(set = 0, binding = 1) uniform sampler2D camera_variance;
// The two levels that are read; where noise is masked twice the atlas, or all levels.
layout(set = 0, binding = 2) uniform sampler2D camera_near;
layout(set = 0, binding = 3) uniform sampler2D camera_far;
layout(set = 0, binding = 4) uniform sampler2D light;
layout(set = 0, binding = 5) uniform sampler2D light_variance;
layout(set = 0, binding = 6) uniform sampler2D light_near;
layout(set = 0, binding = 7) uniform sampler2D light_far;

layout(location = 0) out vec4 xyz;

// The two levels around a level of detail, the places in them, and how far the second counts.
struct Levels {
    Level near;
    Level far;
    vec2 p_near;
    vec2 p_far;
    float f;  // negative below level 0: the kernel narrows
};

Levels levels_at(sampler2D image, sampler2D near, sampler2D far, float lod) {
    Levels at;
    int level = int(max(floor(lod), 0.0));
    ivec2 full = textureSize(image, 0);
    int next = min(level + 1, int(push.max_level));
    if (MASKING) {
        at.near = ATLAS ? atlas_level(full, level) : mip_level(full, level);
        at.far = ATLAS ? atlas_level(full, next) : mip_level(full, next);
    } else {
        at.near = Level(ivec2(0), textureSize(near, 0), 0);
        at.far = Level(ivec2(0), textureSize(far, 0), 0);
    }
    vec2 texel = gl_FragCoord.xy * push.texels + push.pad;
    at.p_near = position(texel, at.near, full);
    at.p_far = position(texel, at.far, full);
    at.f = lod - float(level);
    return at;
}

const bool USUAL = TAPS == 5 && EXPONENT == 8;

vec4 blurred(sampler2D image, vec2 p, Level level, float sigma) {
    return USUAL ? windowed_gaussian(image, p, level, sigma) : truncated_gaussian(image, p, level, sigma);
}

// Wide kernels on both levels keep texels from showing: sigma is 1 at a level of detail of 0 on level 0, and 1 to 4 on the
// coarser of two levels; below 0 it grows to 16, a texel alone, at -1.
vec4 gaussian(sampler2D near, sampler2D far, Levels at, const uint extent) {
    if (at.f < 0.0) {
        float sigma = exp2(-4.0 * at.f);
        return USUAL && sigma >= 4.0 ? narrow_gaussian(near, at.p_near, at.near, sigma)
                                     : blurred(near, at.p_near, at.near, sigma);
    }
    vec4 a = blurred(near, at.p_near, at.near, exp2(-2.0 * at.f));
    if (extent == ONE_LEVEL) {
        return a;
    }
    return mix(a, blurred(far, at.p_far, at.far, exp2(2.0 * (1.0 - at.f))), at.f);
}

// Smallest weight, as a part of the bilinear one, at which the cubic is taken: negative lobes beside an empty region
// would otherwise divide by nearly nothing.
const float CATMULL_ROM_MIN_WEIGHT = 0.05;

vec4 sums_at(sampler2D image, sampler2D near, sampler2D far, float lod, const uint extent) {
    ivec2 texel = ivec2(gl_FragCoord.xy * push.texels + push.pad);
    if (KIND == NONE || extent == TEXEL) {
        return texelFetch(image, texel, 0);
    }
    Levels at = levels_at(image, near, far, lod);
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
    vec2 texel = gl_FragCoord.xy * push.texels + push.pad;
    vec3 total = vec3(0.0);
    if (CAMERA != ABSENT) {
        float lod = push.lod.x;
        if (MASKING && CAMERA != TEXEL) {
            lod = masked_lod(camera, camera_variance, texel, lod, push.variance_lod.x, 0.0);
        }
        vec4 sums = sums_at(camera, camera_near, camera_far, lod, CAMERA);
        total += sums.w > 0.0 ? sums.xyz / sums.w : vec3(0.0);
    }
    if (LIGHT != ABSENT) {
        float lod = push.lod.y;
        if (MASKING && LIGHT != TEXEL) {
            lod = masked_lod(light, light_variance, texel, lod, push.variance_lod.y, 1.0);
        }
        total += sums_at(light, light_near, light_far, lod, LIGHT).xyz * push.light_scale;
    }
    xyz = vec4(total, 1.0);
}
