#version 460

// The encoded pictures of both eyes as one picture. Reference: src/image/stereo/compose.rs.

layout(push_constant) uniform StereoPush {
    ivec2 size;  // of one eye's picture, pixels
} push;

// Left and right eye.
layout(set = 0, binding = 0) uniform sampler2DArray eyes;
// Rows: linear light of the 256 values of each channel; least light that is rounded to a value above the index; rows of the matrices
// that mix the left and the right eye, of the matrix to linear Rec.709, and of that back.
layout(set = 0, binding = 1) uniform sampler2D coding;

layout(location = 0) out vec4 encoded;

// The same numbers as in src/client/pass/stereo.rs.
const uint SIDE_BY_SIDE = 0u;
const uint SIDE_BY_SIDE_HALF = 1u;
const uint OVER_UNDER = 2u;
const uint OVER_UNDER_HALF = 3u;
const uint CROSS_EYED = 4u;
const uint ANAGLYPH = 5u;
const uint ROW_INTERLACED = 6u;
const uint COLUMN_INTERLACED = 7u;
const uint CHECKERBOARD = 8u;
layout(constant_id = 0) const uint LAYOUT = SIDE_BY_SIDE;

vec4 texel(ivec2 at, int eye) {
    return texelFetch(eyes, ivec3(at, eye), 0);
}

vec3 linear(vec4 values) {
    ivec3 i = ivec3(values.rgb * 255.0 + 0.5);
    return vec3(texelFetch(coding, ivec2(i.r, 0), 0).r, texelFetch(coding, ivec2(i.g, 0), 0).g,
                texelFetch(coding, ivec2(i.b, 0), 0).b);
}

// The number of edges up to this light, which ascend.
vec4 rounded(vec3 light) {
    ivec3 value = ivec3(0);
    for (int step = 128; step > 0; step >>= 1) {
        for (int c = 0; c < 3; ++c) {
            if (texelFetch(coding, ivec2(value[c] + step - 1, 1), 0)[c] <= light[c]) {
                value[c] += step;
            }
        }
    }
    return vec4(vec3(value) / 255.0, 1.0);
}

vec3 times(int first, vec3 light) {
    vec3 product;
    for (int row = 0; row < 3; ++row) {
        product[row] = dot(texelFetch(coding, ivec2(first + row, 2), 0).xyz, light);
    }
    return product;
}

// Whole pictures one after the other along an axis.
vec4 tile(ivec2 at, int axis, int first) {
    bool second = at[axis] >= push.size[axis];
    at[axis] -= second ? push.size[axis] : 0;
    return texel(at, second ? 1 - first : first);
}

// Pictures of half the extent one after the other along an axis.
vec4 half_tile(ivec2 at, int axis) {
    int half_size = (push.size[axis] + 1) / 2;
    bool second = at[axis] >= half_size;
    ivec2 a = at;
    a[axis] = 2 * (at[axis] - (second ? half_size : 0));
    ivec2 b = a;
    b[axis] = min(a[axis] + 1, push.size[axis] - 1);
    int eye = second ? 1 : 0;
    return rounded(0.5 * (linear(texel(a, eye)) + linear(texel(b, eye))));
}

vec4 mixed(ivec2 at) {
    vec3 left = times(6, linear(texel(at, 0)));
    vec3 right = times(6, linear(texel(at, 1)));
    vec3 light = clamp(times(0, left) + times(3, right), 0.0, 1.0);
    return rounded(times(9, light));
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    switch (LAYOUT) {
    case SIDE_BY_SIDE: encoded = tile(at, 0, 0); break;
    case CROSS_EYED: encoded = tile(at, 0, 1); break;
    case OVER_UNDER: encoded = tile(at, 1, 0); break;
    case SIDE_BY_SIDE_HALF: encoded = half_tile(at, 0); break;
    case OVER_UNDER_HALF: encoded = half_tile(at, 1); break;
    case ANAGLYPH: encoded = mixed(at); break;
    case ROW_INTERLACED: encoded = texel(at, at.y & 1); break;
    case COLUMN_INTERLACED: encoded = texel(at, at.x & 1); break;
    default: encoded = texel(at, (at.x + at.y) & 1);
    }
}
