#version 460
#extension GL_GOOGLE_include_directive : require

// One sample becomes one square sprite aligned to texels: its centre is moved to the nearest texel corner
// (box: texel centre), so that a sprite of exactly 6 texels covers the whole support of the filter and
// rasterisation cannot cut an edge; the fragment shader weighs by the true position.

#define SPLAT_PUSH
#include "include/layout.glsl"
#include "include/filter.glsl"

// Instanced quads instead of points, for devices without points of this size.
layout(constant_id = 2) const bool QUADS = false;
// Pass on luminance and weight for the variance instead of the colour.
layout(constant_id = 3) const bool LUMINANCE = false;

layout(location = 0) in vec2 uv;
layout(location = 1) in vec4 xyzw;

layout(location = 0) flat out vec2 position;
layout(location = 1) flat out vec4 value;
layout(location = 2) flat out float first_row;

void main() {
    float size = KIND == TENT ? 2.0 : KIND == BOX ? 1.0 : 6.0;
    // Not contracted: a sample must fall into the same texel as on the CPU.
    precise vec2 scaled = uv * push.picture;
    precise vec2 p = scaled + push.pad;
    // False for NaN as well.
    bool inside = p.x >= 0.0 && p.y >= 0.0 && p.x < push.target.x && p.y < push.target.y;
    vec2 centre = KIND == BOX ? floor(p) + 0.5 : floor(p + 0.5);
    // The samples of a batch take the slots in turn.
    first_row = SLOTS > 1u ? float(uint(QUADS ? gl_InstanceIndex : gl_VertexIndex) % SLOTS) * push.target.y : 0.0;
    centre.y += first_row;
    // A point whose centre is outside the view volume may be dropped: rounding must not push one out.
    vec2 ndc = clamp(centre * push.ndc_scale - 1.0, -1.0, 1.0);
    if (QUADS) {
        vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) - 0.5;
        ndc += corner * size * push.ndc_scale;
    }
    gl_Position = inside ? vec4(ndc, 0.0, 1.0) : vec4(8.0, 8.0, 8.0, 1.0);
    gl_PointSize = size;

    position = p;
    float w = abs(xyzw.w);
    value = LUMINANCE ? vec4(xyzw.y / w * push.inverse_scale, w, 0.0, 0.0) : vec4(xyzw.xyz, w);
}
