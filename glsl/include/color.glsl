// Tone curve, gamut and transfer (paper §4.3). Twin of src/client/reference/tonemap.rs.

// 1 - exp(-t) for t >= 0 without cancellation: Taylor's series below 1/2, error below one part in 10^7.
float one_minus_exp(float t) {
    float s = 1.0 - t / 8.0;
    s = 1.0 - t / 7.0 * s;
    s = 1.0 - t / 6.0 * s;
    s = 1.0 - t / 5.0 * s;
    s = 1.0 - t / 4.0 * s;
    s = 1.0 - t / 3.0 * s;
    s = 1.0 - t / 2.0 * s;
    return t < 0.5 ? t * s : 1.0 - exp(-t);
}

// Moves `rgb` towards the grey `y`, all three the same luminance, just far enough to bring every channel into [0, 1].
vec3 desaturate(vec3 rgb, float y) {
    float least = min(rgb.r, min(rgb.g, rgb.b));
    float most = max(rgb.r, max(rgb.g, rgb.b));
    float keep = 1.0;
    if (least < 0.0) {
        keep = y / (y - least);
    }
    if (most > 1.0) {
        keep = min(keep, (1.0 - y) / (most - y));
    }
    return clamp(y + (rgb - y) * keep, 0.0, 1.0);
}

// Largest X/Y and Z/Y used: no real stimulus comes near, and infinity has no hue.
const float MAX_RATIO = 1e4;

// Encoded R, G, B in [0, 1].
vec3 encode(vec3 xyz) {
    float t = pow(push.exposure * xyz.y, push.contrast);
    // Also false for NaN.
    if (!(xyz.y > 0.0 && t > 0.0)) {
        return vec3(0.0);
    }
    float tone = one_minus_exp(t);
    // X/Y first: Y'/Y overflows where Y is tiny.
    vec2 ratio = clamp(xyz.xz / xyz.y, 0.0, MAX_RATIO);
    vec3 toned = vec3(ratio.x, 1.0, ratio.y) * tone;
    vec3 rgb = vec3(dot(push.red.xyz, toned), dot(push.green.xyz, toned), dot(push.blue.xyz, toned));
    return pow(desaturate(rgb, tone), vec3(push.inverse_gamma));
}
