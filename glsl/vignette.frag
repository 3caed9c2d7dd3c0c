#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/layers.glsl"

// Light lost towards the corners of the picture. Reference: src/client/post_process/vignette.rs.

layout(push_constant) uniform VignettePush {
    vec2 middle;        // the middle of the picture, in units of half its diagonal
    float scale;        // half diagonals per texel
    float corner_loss;  // share of the light that is lost half a diagonal away from the middle
} push;

layout(set = 0, binding = 0) uniform sampler2D picture;

layout(location = 0) out vec4 xyz;

void main() {
    vec2 from_middle = gl_FragCoord.xy * push.scale - push.middle;
    float kept = max(1.0 - push.corner_loss * dot(from_middle, from_middle), 0.0);
    xyz = vec4(texelFetch(picture, ivec2(gl_FragCoord.xy), 0).xyz * kept, 1.0);
}
