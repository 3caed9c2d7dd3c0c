// Tone curve, gamut and transfer (paper §4.3). Reference: src/client/reference/tonemap.rs.

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

// Moves `rgb` towards the grey `y`, all three the same luminance, just far enough to bring every channel into [0, ceiling].
vec3 desaturate(vec3 rgb, float y, float ceiling) {
    float least = min(rgb.r, min(rgb.g, rgb.b));
    float most = max(rgb.r, max(rgb.g, rgb.b));
    float keep = 1.0;
    if (least < 0.0) {
        keep = y / (y - least);
    }
    if (most > ceiling) {
        keep = min(keep, (ceiling - y) / (most - y));
    }
    return clamp(y + (rgb - y) * keep, 0.0, ceiling);
}

// The display's matrix, from XYZ or, after a curve in Rec.709, from that.
vec3 profile(vec3 c) {
    return vec3(dot(push.red.xyz, c), dot(push.green.xyz, c), dot(push.blue.xyz, c));
}

// Largest X/Y and Z/Y used: no real stimulus comes near, and infinity has no hue.
const float MAX_RATIO = 1e4;

const uint PAPER = 0u;
const uint PBR_NEUTRAL = 1u;
const uint AGX = 2u;

// Display-linear R, G, B in [0, ceiling], 1 being diffuse white.
vec3 display_linear(vec3 xyz, const uint curve, float ceiling) {
    float t = pow(push.exposure * xyz.y, push.contrast);
    // Also false for NaN.
    if (!(xyz.y > 0.0 && t > 0.0)) {
        return vec3(0.0);
    }
    // X/Y first: Y'/Y overflows where Y is tiny.
    vec2 ratio = clamp(xyz.xz / xyz.y, 0.0, MAX_RATIO);
    if (curve == PAPER) {
        float tone = ceiling * one_minus_exp(t / ceiling);
        return desaturate(profile(vec3(ratio.x, 1.0, ratio.y) * tone), tone, ceiling);
    }
    float y = min(t, MAX_TONE_INPUT);
    vec3 rgb = desaturate(REC709 * (vec3(ratio.x, 1.0, ratio.y) * y), y, 1e12);
    rgb = curve == PBR_NEUTRAL ? pbr_neutral(rgb, ceiling) : agx(rgb);
    float tone = clamp(dot(REC709_LUMINANCE, rgb), 0.0, ceiling);
    return desaturate(profile(rgb), tone, ceiling);
}

// Diffuse white, cd/m2 (ITU-R BT.2408), and the peak that highlights roll off to on an HDR display.
const float DIFFUSE_WHITE = 203.0;
const float PEAK = 1000.0;

// The PQ transfer of SMPTE ST 2084 (ITU-R BT.2100): luminance / 10000 cd/m2 to 0 ... 1.
vec3 pq(vec3 l) {
    vec3 p = pow(clamp(l, 0.0, 1.0), vec3(2610.0 / 16384.0));
    return pow((3424.0 / 4096.0 + 2413.0 / 128.0 * p) / (1.0 + 2392.0 / 128.0 * p), vec3(2523.0 / 32.0));
}
