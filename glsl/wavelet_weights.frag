#version 460
#extension GL_GOOGLE_include_directive : require

// Weights of the noise filter to the first four neighbours: (1 - d/4)^4 of the squared difference d of their features in units of the
// tolerances; 0 out of the picture, and between pixels with different shares of lights.

#include "include/wavelet.glsl"

layout(set = 0, binding = 0) uniform sampler2D albedo_distance;
layout(set = 0, binding = 1) uniform sampler2D normal_lights;
// Of albedo, normal and distance.
layout(set = 0, binding = 2) uniform sampler2D tolerances;

layout(location = 0) out vec4 weights;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 albedo = texelFetch(albedo_distance, at, 0);
    vec4 normal = texelFetch(normal_lights, at, 0);
    vec3 tolerance = texelFetch(tolerances, at, 0).xyz;
    weights = vec4(0.0);
    for (int i = 0; i < 4; ++i) {
        ivec2 there = at + NEIGHBOURS[i] * push.step;
        if (!is_inside(there)) {
            continue;
        }
        vec4 other_normal = texelFetch(normal_lights, there, 0);
        vec4 da = albedo - texelFetch(albedo_distance, there, 0);
        vec3 dn = (normal - other_normal).xyz;
        vec3 squares = vec3(dot(da.xyz, da.xyz), dot(dn, dn), da.w * da.w);
        vec3 relative = squares / (tolerance + texelFetch(tolerances, there, 0).xyz);
        float rest = max(1.0 - 0.5 * (relative.x + relative.y + relative.z), 0.0);
        weights[i] = normal.w == other_normal.w ? rest * rest * rest * rest : 0.0;
    }
}
