// The Gaussians of the paper's §4.3, by the usual kernel. Each returns an average of sums, as those of gather.glsl do.
//
// The including shader defines TEXELS, the type of what texels are read from, and `texel_at`: sampled images in a fragment shader, the
// memory that a workgroup shares in a compute shader. Needs gather.glsl.

// The texel `at` of a level; those beyond its edge are the texels at the edge.
vec4 texel_at(TEXELS texels, Level level, ivec2 at);

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
vec4 windowed_gaussian(TEXELS texels, vec2 p, Level level, float sigma) {
    ivec2 first = ivec2(ceil(p - 3.0));
    vec2 d = vec2(first) + 2.5 - p;  // to the middle tap
    float gx[5] = exponentials(d.x, sigma, first.x, level.size.x);
    float gy[5] = exponentials(d.y, sigma, first.y, level.size.y);
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    for (int y = 0; y < 5; ++y) {
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
            sum += w * texel_at(texels, level, first + ivec2(x, y));
            weights += w;
        }
    }
    return sum / weights;
}

// The same for sigma >= 4, where neither the window nor texels beyond 2 matter: 4×4 texels, separable.
vec4 narrow_gaussian(TEXELS texels, vec2 p, Level level, float sigma) {
    ivec2 first = ivec2(ceil(p - 2.5));
    vec2 d = vec2(first) + 2.5 - p;  // to the third tap of four
    float gx[5] = exponentials(d.x, sigma, first.x, level.size.x);
    float gy[5] = exponentials(d.y, sigma, first.y, level.size.y);
    vec4 sum = vec4(0.0);
    for (int y = 0; y < 4; ++y) {
        vec4 row = vec4(0.0);
        for (int x = 0; x < 4; ++x) {
            row += gx[x] * texel_at(texels, level, first + ivec2(x, y));
        }
        sum += gy[y] * row;
    }
    return sum / (((gx[0] + gx[1]) + (gx[2] + gx[3])) * ((gy[0] + gy[1]) + (gy[2] + gy[3])));
}
