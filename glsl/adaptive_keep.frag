#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/layers.glsl"

// Adaptive filtering: the part of the light that has come to a level and stays there, by the density of samples and at edges.

#include "include/adaptive.glsl"

// The light that has come to this level; statistics and edges of the next coarser one.
layout(set = 0, binding = 0) uniform sampler2D light;
layout(set = 0, binding = 1) uniform sampler2D coarser;
layout(set = 0, binding = 2) uniform sampler2D edges;

layout(location = 0) out vec4 kept;

// K, and the exponent alpha: the kernel has an area of K·density^-alpha pixels.
const float SAMPLES = 48.0;
const float RATE = 0.8;
// Significance of gradients from which on some of the light is kept, and all of it.
const float EDGE_FIRST = 9.0;
const float EDGE_LAST = 18.0;

float share(ivec2 at) {
    vec4 around = interpolated(coarser, at);
    float by_density = 0.0;
    if (around.x > 0.0 && around.y > 0.0) {
        float wanted = 0.5 * (log2(SAMPLES) - RATE * log2(around.x * (around.x / around.y)));
        by_density = clamp(1.0 + float(push.level) - wanted, 0.0, 1.0);
    }
    float largest = 0.0;
    ivec2 last = textureSize(edges, 0) - 1;
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            largest = max(largest, texelFetch(edges, clamp((at >> 1) + ivec2(x, y), ivec2(0), last), 0).r);
        }
    }
    return max(by_density, clamp((largest - EDGE_FIRST) / (EDGE_LAST - EDGE_FIRST), 0.0, 1.0));
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 sum = texelFetch(light, at + push.offset, 0);
    kept = push.level < push.finest ? vec4(0.0) : sum * share(at);
}
