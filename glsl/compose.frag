#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/layers.glsl"

// A layer of the picture: a region that has samples of its own, mixed with what is there, or a group of lights, added to it.

layout(push_constant) uniform ComposePush {
    vec4 x;               // rows of the matrix that the layer's XYZ are multiplied by; w unused
    vec4 y;
    vec4 z;
    ivec4 part;           // the part of the picture that is drawn: first texel, and one past the last
    ivec2 origin;         // the layer's first texel in the picture
    float share;          // its part of what is shown there
    float padding;
} push;

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
