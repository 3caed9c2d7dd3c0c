// A batch of a small film is drawn into several copies of the target, one below the other, so that no texel takes so many
// samples that its f32 sum drifts; the fold adds the copies.

#include "include/filter.glsl"

// Centre of this fragment's texel in its own copy, whose first row is given.
vec2 slot_texel(float first_row) {
    return SLOTS > 1u ? vec2(gl_FragCoord.x, gl_FragCoord.y - first_row) : gl_FragCoord.xy;
}

// The filter's weight there, 0 where a sprite reaches into the next copy.
float slot_weight(vec2 texel, vec2 position) {
    bool inside = SLOTS == 1u || (texel.y > 0.0 && texel.y < push.target.y);
    return inside ? splat_weight(texel - position) : 0.0;
}
