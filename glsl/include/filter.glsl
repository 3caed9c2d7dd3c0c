// The splat filter's 1-D weight, by arithmetic: NVIDIA's hardware bilinear filter has 8-bit fractions.
// The same as src/client/filter.rs.

const uint GAUSSIAN = 0u;
const uint TENT = 1u;
const uint BOX = 2u;
const uint SCALED_GAUSSIAN = 3u;
const uint SCALED_TENT = 4u;

// The kind, and above 8 bits the size of a scaled one in thousandths of a texel.
layout(constant_id = 0) const uint FILTER = GAUSSIAN;
const uint KIND = FILTER & 255u;
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
    if (KIND >= SCALED_GAUSSIAN) {
        float size = float(FILTER >> 8) * 1e-3;
        vec2 s = a / size;
        vec2 tent = 1.0 - s;
        // Less its value at 4, over its area.
        vec2 gaussian = (exp(-0.5 * s * s) - 3.3546263e-4) / 2.5037858;
        vec2 f = max(KIND == SCALED_TENT ? tent : gaussian, 0.0) / size;
        return f.x * f.y;
    }
    if (KIND == TENT) {
        vec2 t = max(1.0 - a, 0.0);
        return t.x * t.y;
    }
    if (KIND == BOX) {
        return 1.0;
    }
    vec2 f = SLOPE.x * max(3.0 - a, 0.0) + SLOPE.y * max(2.0 - a, 0.0) + SLOPE.z * max(1.0 - a, 0.0);
    return f.x * f.y;
}
