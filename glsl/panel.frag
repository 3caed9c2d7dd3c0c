#version 460

// Puts the panel, drawn in sRGB into an image of its own, over a picture in a window with another encoding.

// 0: linear with sRGB primaries, 1 stands for 80 cd/m² (IEC 61966-2-2); 1: Rec.2020 primaries, PQ (SMPTE ST 2084).
layout(constant_id = 0) const uint ENCODING = 0u;

layout(set = 0, binding = 0) uniform sampler2D panel;

// Premultiplied.
layout(location = 0) out vec4 color;

// Luminance of white paper and of white text, cd/m² (ITU-R BT.2408).
const float WHITE = 203.0;

// IEC 61966-2-1.
vec3 srgb_to_linear(vec3 c) {
    return mix(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, lessThanEqual(c, vec3(0.04045)));
}

// ITU-R BT.2087, equation for M2, by columns.
const mat3 TO_REC2020 = mat3(0.6274, 0.0691, 0.0164, 0.3293, 0.9195, 0.0880, 0.0433, 0.0114, 0.8956);

// Inverse EOTF of SMPTE ST 2084; luminance relative to 10,000 cd/m².
vec3 pq(vec3 luminance) {
    vec3 p = pow(max(luminance, vec3(0.0)), vec3(0.1593017578125));
    return pow((0.8359375 + 18.8515625 * p) / (1.0 + 18.6875 * p), vec3(78.84375));
}

void main() {
    vec4 texel = texelFetch(panel, ivec2(gl_FragCoord.xy), 0);
    // Colours that add light without covering anything have no opacity: they are drawn as faint ones.
    float opacity = max(texel.a, max(texel.r, max(texel.g, texel.b)));
    vec3 linear = srgb_to_linear(texel.rgb / max(opacity, 1.0 / 255.0));
    vec3 encoded = ENCODING == 0u ? linear * (WHITE / 80.0) : pq(TO_REC2020 * linear * (WHITE / 10000.0));
    color = vec4(encoded * opacity, opacity);
}
