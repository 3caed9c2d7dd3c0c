#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/layers.glsl"

// A perspective view into a picture of all directions. Reference: src/client/post_process/look_around.rs and panorama.rs, operation by operation.

layout(push_constant) uniform LookAroundPush {
    vec4 corner;   // direction of the top left corner of the picture, in camera space; w unused
    vec4 across;   // its change per texel to the right
    vec4 down;     // its change per texel down
    vec2 size;     // texels that the picture covers
    float focal;   // focal length of a fisheye lens, texels
    float padding;
} push;

layout(set = 0, binding = 0) uniform sampler2D picture;

layout(location = 0) out vec4 xyz;

// How the picture shows all directions.
const uint SPHERICAL = 0u;
const uint OVER_UNDER = 1u;
const uint CUBE_BLOCK = 2u;
const uint CUBE_ROW = 3u;
const uint CUBE_COLUMN = 4u;
const uint CUBE_CROSS = 5u;
const uint FISHEYE_EQUIDISTANT = 6u;
const uint FISHEYE_EQUISOLID = 7u;
const uint FISHEYE_STEREOGRAPHIC = 8u;
const uint FISHEYE_ORTHOGRAPHIC = 9u;
layout(constant_id = 0) const uint PROJECTION = SPHERICAL;
const bool IS_CUBE = PROJECTION >= CUBE_BLOCK && PROJECTION <= CUBE_CROSS;
const bool IS_FISHEYE = PROJECTION >= FISHEYE_EQUIDISTANT;

// The faces of a cube (right, left, up, down, front, back): the directions of the middle, the right edge and the upper edge of each.
const vec3 AHEAD[6] = vec3[](vec3(-1, 0, 0), vec3(1, 0, 0), vec3(0, 1, 0), vec3(0, -1, 0), vec3(0, 0, 1), vec3(0, 0, -1));
const vec3 RIGHT[6] = vec3[](vec3(0, 0, -1), vec3(0, 0, 1), vec3(-1, 0, 0), vec3(-1, 0, 0), vec3(-1, 0, 0), vec3(1, 0, 0));
const vec3 UP[6] = vec3[](vec3(0, 1, 0), vec3(0, 1, 0), vec3(0, 0, -1), vec3(0, 0, 1), vec3(0, 1, 0), vec3(0, 1, 0));
const ivec2 CROSS[6] = ivec2[](ivec2(2, 1), ivec2(0, 1), ivec2(1, 0), ivec2(1, 2), ivec2(1, 1), ivec2(3, 1));

const float PI = 3.14159265;

// Columns and rows of equal cells, one for each face or eye.
vec2 cells() {
    switch (PROJECTION) {
        case OVER_UNDER: return vec2(1, 2);
        case CUBE_BLOCK: return vec2(3, 2);
        case CUBE_ROW: return vec2(6, 1);
        case CUBE_COLUMN: return vec2(1, 6);
        case CUBE_CROSS: return vec2(4, 3);
        default: return vec2(1, 1);
    }
}

// Column and row of a face; of the eye that views show.
vec2 cell_of(int face) {
    switch (PROJECTION) {
        case CUBE_BLOCK: return vec2(face % 3, face / 3);
        case CUBE_ROW: return vec2(face, 0);
        case CUBE_COLUMN: return vec2(0, face);
        case CUBE_CROSS: return vec2(CROSS[face]);
        default: return vec2(0, 0);
    }
}

// Width and height of a cell, texels.
vec2 cell_size() {
    return push.size / cells();
}

int face_of(vec3 d) {
    int best = 0;
    for (int face = 1; face < 6; ++face) {
        if (dot(d, AHEAD[face]) > dot(d, AHEAD[best])) {
            best = face;
        }
    }
    return best;
}

// The place of a direction before the plane of a face.
vec2 on_face(int face, vec3 d) {
    vec2 across = vec2(dot(d, RIGHT[face]), -dot(d, UP[face])) / dot(d, AHEAD[face]);
    return (cell_of(face) + 0.5 * (across + 1.0)) * cell_size();
}

// The direction of a place in the plane of a face, which goes on beyond its edges.
vec3 on_plane(int face, vec2 place) {
    vec2 across = 2.0 * (place / cell_size() - cell_of(face)) - 1.0;
    return AHEAD[face] + RIGHT[face] * across.x - UP[face] * across.y;
}

// The first texel whose centre lies in or behind a cell, along each axis.
ivec2 first_texel(vec2 cell) {
    return ivec2(ceil(cell * cell_size() - 0.5));
}

// The texel of the picture that stands for this one of a face, which may lie one beyond its edges.
ivec2 texel_of(int face, ivec2 texel) {
    vec2 cell = cell_of(face);
    ivec2 last = first_texel(cell + 1.0) - 1;
    ivec2 inside = clamp(texel, first_texel(cell), last);
    if (IS_FISHEYE) {
        return inside;
    }
    if (!IS_CUBE) {
        // The edges at the left and at the right continue each other; beyond a pole the picture goes on half a turn farther.
        int width = last.x + 1;
        int turned = inside.y == texel.y ? texel.x : texel.x + width / 2;
        return ivec2((turned + width) % width, inside.y);
    }
    // At a corner three faces meet, and there is no fourth texel.
    ivec2 beside = inside.x == texel.x ? texel : ivec2(texel.x, inside.y);
    if (beside == inside) {
        return inside;
    }
    vec3 direction = on_plane(face, vec2(beside) + 0.5);
    int other = face_of(direction);
    vec2 cell_beside = cell_of(other);
    return clamp(ivec2(floor(on_face(other, direction))), first_texel(cell_beside), first_texel(cell_beside + 1.0) - 1);
}

// The angle of (x, y) to the x axis, as the reference has it (Abramowitz and Stegun 4.4.49).
float arc_tangent(float y, float x) {
    float a = min(abs(x), abs(y)) / max(max(abs(x), abs(y)), 1.17549435e-38);
    float s = a * a;
    float sum = 0.0028662258;
    sum = sum * s - 0.016165737;
    sum = sum * s + 0.042909615;
    sum = sum * s - 0.07528964;
    sum = sum * s + 0.10656264;
    sum = sum * s - 0.142089;
    sum = sum * s + 0.19993551;
    float angle = a * (1.0 + s * (sum * s - 0.33333147));
    angle = abs(y) > abs(x) ? 0.5 * PI - angle : angle;
    angle = x < 0.0 ? PI - angle : angle;
    return y < 0.0 ? -angle : angle;
}

// Radius in the picture of a fisheye lens per length of a direction across its axis; negative where it shows nothing.
float magnification(vec3 d) {
    float len = length(d);
    if (PROJECTION == FISHEYE_EQUISOLID) {
        return 2.0 / sqrt(2.0 * len * max(len + d.z, 1e-6 * len));
    }
    if (PROJECTION == FISHEYE_STEREOGRAPHIC) {
        return len + d.z > 1e-4 * len ? 2.0 / (len + d.z) : -1.0;
    }
    if (PROJECTION == FISHEYE_ORTHOGRAPHIC) {
        return d.z >= 0.0 ? 1.0 / len : -1.0;
    }
    float across = length(d.xy);
    return arc_tangent(across, d.z) / max(across, 1e-20);
}

void main() {
    vec3 d = push.corner.xyz + push.across.xyz * gl_FragCoord.x + push.down.xyz * gl_FragCoord.y;
    int face = 0;
    vec2 place;
    if (IS_CUBE) {
        face = face_of(d);
        place = on_face(face, d);
    } else if (IS_FISHEYE) {
        float factor = magnification(d);
        place = 0.5 * push.size - d.xy * (factor * push.focal);
        if (factor < 0.0 || any(lessThan(place, vec2(0.0))) || any(greaterThan(place, push.size))) {
            xyz = vec4(0.0, 0.0, 0.0, 1.0);
            return;
        }
    } else {
        place = vec2(0.5 + arc_tangent(-d.x, d.z) / (2.0 * PI), arc_tangent(length(d.xz), d.y) / PI) * cell_size();
    }
    vec2 corner = floor(place - 0.5);
    vec2 share = place - 0.5 - corner;
    ivec2 at = ivec2(corner);
    vec3 top = mix(texelFetch(picture, texel_of(face, at), 0).xyz,
                   texelFetch(picture, texel_of(face, at + ivec2(1, 0)), 0).xyz, share.x);
    vec3 bottom = mix(texelFetch(picture, texel_of(face, at + ivec2(0, 1)), 0).xyz,
                      texelFetch(picture, texel_of(face, at + ivec2(1, 1)), 0).xyz, share.x);
    xyz = vec4(mix(top, bottom, share.y), 1.0);
}
