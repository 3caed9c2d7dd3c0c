// The three ways of the paper's Figure 2 to read an image of sums at a fractional level.
// Each returns an average of sums: XYZ and W keep their ratio, and levels mix rightly.
//
// A level is a rectangle of the only level of some image: the view of one level, or the atlas of all levels where the
// level differs from pixel to pixel. Fetching from different levels within a quad is what lavapipe cannot do (it takes
// the first pixel's level for all four), and a constant level is also the faster path.
struct Level {
    ivec2 origin;
    ivec2 size;
};

// The level of an atlas, whose level 0 has the extent `full`; twin of `atlas_origin` in src/client/pass/images.rs.
Level atlas_level(ivec2 full, int level) {
    ivec2 size = max(full >> level, ivec2(1));
    // The next power of two.
    int high = 1 << (findMSB(max(full.y - 1, 0)) + 1);
    ivec2 origin = level == 0 ? ivec2(0) : ivec2(full.x, high - (high >> (level - 1)) + level);
    return Level(origin, size);
}

// Sum of the texels around `uv` by the windowed Gaussian exp(-sigma d^2) (1 - smoothstep(0, 2.5, d)^8), divided by
// the sum of weights. `RADIUS` taps on either side of the middle one. The exponential is separable and its taps are
// one texel apart, so exp is needed three times an axis: exp(-sigma (d+i)^2) = a b^i c^(i^2).
// Out-of-range texels are skipped.
vec4 windowed_gaussian(sampler2D image, vec2 uv, Level level, float sigma, const int RADIUS) {
    vec2 p = uv * vec2(level.size);
    ivec2 middle = ivec2(ceil(p - 3.0)) + 2;
    vec2 d = vec2(middle) + 0.5 - p;
    vec2 a = exp(-sigma * d * d);
    vec2 b = exp(-2.0 * sigma * d);
    float c = exp(-sigma);
    vec2 inverse_b = 1.0 / b;
    // By index offset -2 … 2.
    vec2 near_minus = a * inverse_b * c;
    vec2 near_plus = a * b * c;
    float c4 = (c * c) * (c * c);
    vec2 g[5] = vec2[5](a * (inverse_b * inverse_b) * c4, near_minus, a, near_plus, a * (b * b) * c4);

    ivec2 last = level.size - 1;
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    for (int y = -RADIUS; y <= RADIUS; ++y) {
        int ty = middle.y + y;
        float dy = d.y + float(y);
        float gy = ty >= 0 && ty <= last.y ? g[y + 2].y : 0.0;
        for (int x = -RADIUS; x <= RADIUS; ++x) {
            int tx = middle.x + x;
            float dx = d.x + float(x);
            // t = (d / 2.5)^2 clamped; s = smoothstep = t (3 - 2 sqrt(t)).
            float t = min((dx * dx + dy * dy) * (1.0 / 6.25), 1.0);
            float s = t * (3.0 - 2.0 * sqrt(t));
            float s2 = s * s;
            float s4 = s2 * s2;
            float window = 1.0 - s4 * s4;
            float w = tx >= 0 && tx <= last.x ? g[x + 2].x * gy * window : 0.0;
            sum += w * texelFetch(image, level.origin + clamp(ivec2(tx, ty), ivec2(0), last), 0);
            weights += w;
        }
    }
    return sum / weights;
}

// Catmull-Rom weights of the four texels around a position with fraction `t` after the second.
vec4 catmull_rom_weights(float t) {
    float t2 = t * t;
    float t3 = t2 * t;
    return 0.5 * vec4(-t3 + 2.0 * t2 - t, 3.0 * t3 - 5.0 * t2 + 2.0, -3.0 * t3 + 4.0 * t2 + t, t3 - t2);
}

// 4×4 Catmull-Rom, clamped to the edge; the weights sum to 1.
vec4 catmull_rom(sampler2D image, vec2 uv, Level level) {
    vec2 p = uv * vec2(level.size) - 0.5;
    vec2 base = floor(p);
    vec4 wx = catmull_rom_weights(p.x - base.x);
    vec4 wy = catmull_rom_weights(p.y - base.y);
    ivec2 last = level.size - 1;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < 4; ++y) {
        vec4 row = vec4(0.0);
        for (int x = 0; x < 4; ++x) {
            ivec2 at = clamp(ivec2(base) + ivec2(x - 1, y - 1), ivec2(0), last);
            row += wx[x] * texelFetch(image, level.origin + at, 0);
        }
        sum += wy[y] * row;
    }
    return sum;
}

// Bilinear, clamped to the edge.
vec4 bilinear(sampler2D image, vec2 uv, Level level) {
    vec2 p = clamp(uv * vec2(level.size) - 0.5, vec2(0.0), vec2(level.size - 1));
    ivec2 a = ivec2(p);
    ivec2 b = min(a + 1, level.size - 1);
    vec2 f = p - vec2(a);
    a += level.origin;
    b += level.origin;
    vec4 top = mix(texelFetch(image, a, 0), texelFetch(image, ivec2(b.x, a.y), 0), f.x);
    vec4 bottom = mix(texelFetch(image, ivec2(a.x, b.y), 0), texelFetch(image, b, 0), f.x);
    return mix(top, bottom, f.y);
}
