#version 460
#extension GL_GOOGLE_include_directive : require

// First pass of the noise filter: the halves become sums. Half of what only one of them has seen is set aside: it stays where it is and
// does not spread.

#include "include/wavelet.glsl"

// Mean X, Y, Z of the samples of each half, and their number.
layout(set = 0, binding = 0) uniform sampler2D half_a;
layout(set = 0, binding = 1) uniform sampler2D half_b;

layout(location = 0) out vec4 sums_a;
layout(location = 1) out vec4 sums_b;
layout(location = 2) out vec4 aside;

// What one half has seen alone is set aside above this many times the other half's largest luminance in the square around.
const float FIREFLY = 8.0;
const int AROUND = 2;

float largest_around(sampler2D pixels, ivec2 at) {
    float most = 0.0;
    ivec2 last = min(at + AROUND, push.extent - 1);
    for (int y = max(at.y - AROUND, 0); y <= last.y; ++y) {
        for (int x = max(at.x - AROUND, 0); x <= last.x; ++x) {
            vec4 there = texelFetch(pixels, ivec2(x, y), 0);
            // False for NaN.
            most = there.w > 0.0 && there.y > most ? there.y : most;
        }
    }
    return most;
}

// The sum of a half.
vec4 separate(vec4 own, bool both, float limit) {
    if (both && own.y > limit) {
        vec3 kept = own.xyz * (limit / own.y);
        aside.xyz += 0.5 * (own.xyz - kept);
        own.xyz = kept;
    }
    return own.w > 0.0 ? vec4(own.xyz * own.w, own.w) : vec4(0.0);
}

vec4 finite(vec4 pixel) {
    return any(isnan(pixel)) || any(isinf(pixel)) ? vec4(0.0) : pixel;
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 a = finite(texelFetch(half_a, at, 0));
    vec4 b = finite(texelFetch(half_b, at, 0));
    bool both = a.w > 0.0 && b.w > 0.0;
    aside = vec4(0.0);
    sums_a = separate(a, both, FIREFLY * largest_around(half_b, at));
    sums_b = separate(b, both, FIREFLY * largest_around(half_a, at));
}
