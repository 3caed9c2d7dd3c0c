// The three ways of the paper's Figure 2 to read an image of sums at a fractional level.
// Each returns an average of sums: XYZ and W keep their ratio, and levels mix rightly.
//
// A level is a rectangle of level `mip` of some image: a view of one level, or, where the level differs from pixel to pixel, a level
// of the view of all of them. Fetching from different levels within a quad is impossible on lavapipe (it takes the first pixel's
// level for all four): there it is a rectangle of the atlas of all levels.
struct Level {
    ivec2 origin;
    ivec2 size;
    int mip;
};

// The level of an image of all levels, whose level 0 has the extent `full`.
Level mip_level(ivec2 full, int level) {
    return Level(ivec2(0), max(full >> level, ivec2(1)), level);
}

// The level of an atlas, whose level 0 has the extent `full`; the same as `atlas_origin` in src/client/pass/images.rs.
Level atlas_level(ivec2 full, int level) {
    ivec2 size = max(full >> level, ivec2(1));
    // The next power of two.
    int high = 1 << (findMSB(max(full.y - 1, 0)) + 1);
    ivec2 origin = level == 0 ? ivec2(0) : ivec2(full.x, high - (high >> (level - 1)) + level);
    return Level(origin, size, 0);
}

// Position in texels of a level, from texels of level 0, whose extent is `full`; exact on level 0.
vec2 position(vec2 texel, Level level, ivec2 full) {
    return level.size == full ? texel : texel * (vec2(level.size) / vec2(full));
}

// exp(-sigma d^2) at d - 2 … d + 2 (x to w and the last): the taps are one texel apart, so exp is needed three times:
// exp(-sigma (d+i)^2) = a b^i c^(i^2). Zero for texels `first + i` outside of 0 … size - 1.
float[5] exponentials(float d, float sigma, int first, int size) {
    float a = exp(-sigma * d * d);
    float b = exp(-2.0 * sigma * d);
    float c = exp(-sigma);
    float inverse_b = 1.0 / b;
    float c4 = (c * c) * (c * c);
    float g[5] = float[5](a * (inverse_b * inverse_b) * c4, a * inverse_b * c, a, a * b * c, a * (b * b) * c4);
    for (int i = 0; i < 5; ++i) {
        g[i] = first + i >= 0 && first + i < size ? g[i] : 0.0;
    }
    return g;
}

// Mean of the 5×5 texels around `p` by the windowed Gaussian exp(-sigma d^2) (1 - smoothstep(0, 2.5, d)^8).
// Out-of-range texels are skipped.
vec4 windowed_gaussian(sampler2D image, vec2 p, Level level, float sigma) {
    ivec2 first = ivec2(ceil(p - 3.0));
    vec2 d = vec2(first) + 2.5 - p;  // to the middle tap
    float gx[5] = exponentials(d.x, sigma, first.x, level.size.x);
    float gy[5] = exponentials(d.y, sigma, first.y, level.size.y);
    ivec2 last = level.size - 1;
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    for (int y = 0; y < 5; ++y) {
        int ty = level.origin.y + clamp(first.y + y, 0, last.y);
        float dy = d.y + float(y - 2);
        float dy2 = dy * dy * (1.0 / 6.25);
        for (int x = 0; x < 5; ++x) {
            // t = (d / 2.5)^2 clamped; s = smoothstep = t (3 - 2 sqrt(t)).
            float dx = d.x + float(x - 2);
            float t = min(dx * dx * (1.0 / 6.25) + dy2, 1.0);
            float s = t * (3.0 - 2.0 * sqrt(t));
            float s2 = s * s;
            float s4 = s2 * s2;
            float w = (1.0 - s4 * s4) * (gx[x] * gy[y]);
            sum += w * texelFetch(image, ivec2(level.origin.x + clamp(first.x + x, 0, last.x), ty), level.mip);
            weights += w;
        }
    }
    return sum / weights;
}

// The same for sigma >= 4, where neither the window nor texels beyond 2 matter: 4×4 texels, separable.
vec4 narrow_gaussian(sampler2D image, vec2 p, Level level, float sigma) {
    ivec2 first = ivec2(ceil(p - 2.5));
    vec2 d = vec2(first) + 2.5 - p;  // to the third tap of four
    float gx[5] = exponentials(d.x, sigma, first.x, level.size.x);
    float gy[5] = exponentials(d.y, sigma, first.y, level.size.y);
    ivec2 last = level.size - 1;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < 4; ++y) {
        int ty = level.origin.y + clamp(first.y + y, 0, last.y);
        vec4 row = vec4(0.0);
        for (int x = 0; x < 4; ++x) {
            row += gx[x] * texelFetch(image, ivec2(level.origin.x + clamp(first.x + x, 0, last.x), ty), level.mip);
        }
        sum += gy[y] * row;
    }
    return sum / (((gx[0] + gx[1]) + (gx[2] + gx[3])) * ((gy[0] + gy[1]) + (gy[2] + gy[3])));
}

// Catmull-Rom weights of the four texels around a position with fraction `t` after the second.
vec4 catmull_rom_weights(float t) {
    float t2 = t * t;
    float t3 = t2 * t;
    return 0.5 * vec4(-t3 + 2.0 * t2 - t, 3.0 * t3 - 5.0 * t2 + 2.0, -3.0 * t3 + 4.0 * t2 + t, t3 - t2);
}

// 4×4 Catmull-Rom, clamped to the edge; the weights sum to 1.
vec4 catmull_rom(sampler2D image, vec2 at_texel, Level level) {
    vec2 p = at_texel - 0.5;
    vec2 base = floor(p);
    vec4 wx = catmull_rom_weights(p.x - base.x);
    vec4 wy = catmull_rom_weights(p.y - base.y);
    ivec2 last = level.size - 1;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < 4; ++y) {
        vec4 row = vec4(0.0);
        for (int x = 0; x < 4; ++x) {
            ivec2 at = clamp(ivec2(base) + ivec2(x - 1, y - 1), ivec2(0), last);
            row += wx[x] * texelFetch(image, level.origin + at, level.mip);
        }
        sum += wy[y] * row;
    }
    return sum;
}

// Bilinear, clamped to the edge. By arithmetic: the texture units of GPUs interpolate with fractions of 8 bits.
vec4 bilinear(sampler2D image, vec2 at_texel, Level level) {
    vec2 p = clamp(at_texel - 0.5, vec2(0.0), vec2(level.size - 1));
    ivec2 a = ivec2(p);
    ivec2 b = min(a + 1, level.size - 1);
    vec2 f = p - vec2(a);
    a += level.origin;
    b += level.origin;
    vec4 top = mix(texelFetch(image, a, level.mip), texelFetch(image, ivec2(b.x, a.y), level.mip), f.x);
    vec4 bottom = mix(texelFetch(image, ivec2(a.x, b.y), level.mip), texelFetch(image, b, level.mip), f.x);
    return mix(top, bottom, f.y);
}

// Trilinear at `texel` of level 0, from a view of all levels; `lod` is the same for the whole picture.
vec4 trilinear(sampler2D image, vec2 texel, float lod) {
    ivec2 full = textureSize(image, 0);
    int near = int(lod);
    int far = min(near + 1, textureQueryLevels(image) - 1);
    Level a = mip_level(full, near);
    Level b = mip_level(full, far);
    return mix(bilinear(image, position(texel, a, full), a), bilinear(image, position(texel, b, full), b),
               lod - float(near));
}
