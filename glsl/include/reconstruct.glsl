// What reconstruct.frag and reconstruct.comp have in common: bindings, constants, and the Gaussian over two levels (paper §4.3).
// Specialization constants compile out what is off: a stream without samples, noise masking, the second level.
//
// The including shader defines TEXELS first; see gaussian.glsl.

#define RECONSTRUCT_PUSH
#include "include/layout.glsl"
#include "include/gather.glsl"
#include "include/gaussian.glsl"

const uint GAUSSIAN = 0u;
const uint CATMULL_ROM = 1u;
const uint MIPMAP = 2u;
const uint NONE = 3u;

// The part of the kernel that a stream needs; the host knows the level of detail unless noise is masked.
const uint ABSENT = 0u;      // no samples yet
const uint TEXEL = 1u;       // level of detail <= -1: the blur is below one texel, or was done before
const uint ONE_LEVEL = 2u;   // between -1 and 0
const uint TWO_LEVELS = 3u;  // any, also per pixel
const uint FILTERED = 4u;    // sums without overscan, filtered adaptively

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

// The place of a pixel's centre, pixels, in texels of level 0.
vec2 place_of(vec2 pixel) {
    return pixel * push.texels + push.pad;
}

// Adaptively filtered sums; a texel as it is where pixels have its size.
vec4 filtered_at(sampler2D image, vec2 place) {
    return bilinear(image, place - push.pad, Level(ivec2(0), textureSize(image, 0), 0));
}

// The two levels around a level of detail, the places in them, and how far the second counts.
struct Levels {
    Level near;
    Level far;
    vec2 p_near;
    vec2 p_far;
    float f;  // negative below level 0: the kernel narrows
};

Levels levels_at(sampler2D image, sampler2D near, sampler2D far, float lod, vec2 texel) {
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
    at.p_near = position(texel, at.near, full);
    at.p_far = position(texel, at.far, full);
    at.f = lod - float(level);
    return at;
}

const bool USUAL = TAPS == 5 && EXPONENT == 8;

vec4 blurred(TEXELS texels, vec2 p, Level level, float sigma) {
    return USUAL ? windowed_gaussian(texels, p, level, sigma) : truncated_gaussian(texels, p, level, sigma);
}

// Wide kernels on both levels keep texels from showing: sigma is 1 at a level of detail of 0 on level 0, and 1 to 4 on the
// coarser of two levels; below 0 it grows to 16, a texel alone, at -1.
vec4 gaussian(TEXELS near, TEXELS far, Levels at, const uint extent) {
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

// The radiance that the sums of the two streams give: the mean of the one, and the other as it is.
vec3 radiance(vec4 of_camera, vec4 of_light) {
    vec3 mean = CAMERA != ABSENT && of_camera.w > 0.0 ? of_camera.xyz / of_camera.w : vec3(0.0);
    return LIGHT == ABSENT ? mean : mean + of_light.xyz * push.light_scale;
}
