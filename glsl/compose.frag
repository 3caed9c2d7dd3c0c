#version 460
#extension GL_GOOGLE_include_directive : require

// A layer of the picture: a region that has samples of its own, mixed with what is there, or a group of lights, added to it.

#define COMPOSE_PUSH
#include "include/layout.glsl"

layout(set = 0, binding = 0) uniform sampler2D layer;

layout(location = 0) out vec4 xyz;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    if (any(lessThan(at, push.part.xy)) || any(greaterThanEqual(at, push.part.zw))) {
        discard;
    }
    ivec2 texel = at - push.origin;
    vec3 value = texelFetch(layer, texel, 0).xyz;
    vec3 product = vec3(dot(push.x.xyz, value), dot(push.y.xyz, value), dot(push.z.xyz, value));
    xyz = vec4(product, 1.0) * push.share;
}
