#version 460
#extension GL_GOOGLE_include_directive : require

// Last pass of the noise filter: what was set aside comes back, and no light is negative.

#include "include/wavelet.glsl"

layout(set = 0, binding = 0) uniform sampler2D result;
layout(set = 0, binding = 1) uniform sampler2D aside;
// The gain of the finest band without features in w.
layout(set = 0, binding = 2) uniform sampler2D finest;
// The sums of the coarsest level.
layout(set = 0, binding = 3) uniform sampler2D sums_a;
layout(set = 0, binding = 4) uniform sampler2D sums_b;
layout(set = 0, binding = 5) uniform sampler2D half_a;
layout(set = 0, binding = 6) uniform sampler2D half_b;

// X, Y, Z, and the gain of what differs from pixel to pixel.
layout(location = 0) out vec4 filtered;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 xyz = texelFetch(result, at, 0).xyz;
    if (xyz.y < 0.0) {
        // Beside a bright sample a kept band may take more than there is. What is seen there, or what is around, is more likely.
        vec3 around = mean_of_halves(texelFetch(sums_a, at, 0), texelFetch(sums_b, at, 0));
        vec4 a = texelFetch(half_a, at, 0);
        vec4 b = texelFetch(half_b, at, 0);
        vec3 seen = (a.xyz * a.w + b.xyz * b.w) / (a.w + b.w);
        xyz = seen.y < around.y ? seen : around;
    }
    filtered = vec4(xyz + texelFetch(aside, at, 0).xyz, texelFetch(finest, at, 0).w);
}
