// The splat filter's 1-D weight, by arithmetic: NVIDIA's hardware bilinear filter has 8-bit fractions.
// The same as src/client/filter.rs.

const uint GAUSSIAN = 0u;
const uint TENT = 1u;
const uint BOX = 2u;

layout(constant_id = 0) const uint FILTER = GAUSSIAN;
// Copies of the padded target, one below the other, among which a batch is dealt; FilmSpec::batch_slots.
layout(constant_id = 1) const uint SLOTS = 1u;

// g(i) = exp(-i^2) (1 - smoothstep(0, 3, |i|)^8) for i = 0, 1, 2, divided by g(0) + 2 g(1) + 2 g(2).
// The piecewise-linear interpolation of g, with 0 at 3, is the sum of three tents of radius 3, 2 and 1
// whose heights are the changes of slope: all are positive, so nothing cancels.
const float G0 = 0.5652736116;
const float G1 = 0.2079482957;
const float G2 = 0.0094148984;
const vec3 SLOPE = vec3(G2, G1 - 2.0 * G2, G0 - 2.0 * G1 + G2);

// Weights of both axes multiplied; `d` is texel centre minus sample, texels.
float splat_weight(vec2 d) {
    vec2 a = abs(d);
    if (FILTER == TENT) {
        vec2 t = max(1.0 - a, 0.0);
        return t.x * t.y;
    }
    if (FILTER == BOX) {
        return 1.0;
    }
    vec2 f = SLOPE.x * max(3.0 - a, 0.0) + SLOPE.y * max(2.0 - a, 0.0) + SLOPE.z * max(1.0 - a, 0.0);
    return f.x * f.y;
}
