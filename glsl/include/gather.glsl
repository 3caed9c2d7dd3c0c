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
