// Noise masking: the level of detail at which the relative error of the mean is acceptable (paper §4.3, made
// relative and dimensionless). The same as src/client/lod.rs. Images are views of all levels, places are in texels of level 0.
// Needs gather.glsl.

// The relative variance that needs no further blur: 5 % standard error.
const float ACCEPTED = 0.05 * 0.05;
// Luminance below this share of the scale counts as dark: its relative error is of no interest.
const float DARK = 0.02;

// Relative variance of the mean after the blur of level `lod`. `summed` is 1 for the light stream, whose sums are shown: the number
// of samples is random, which adds 1 to the relative variance of each (Poisson); 0 for the camera stream. `variance_lod` is the
// level at which variance and colour are read.
float relative_variance(sampler2D color, sampler2D variance, vec2 texel, float lod, float variance_lod, float summed) {
    float v = trilinear(variance, texel, variance_lod).r;
    vec2 yw = trilinear(color, texel, variance_lod).yw;
    if (!(yw.y > 0.0)) {
        return 1.0;
    }
    float n1 = yw.y / push.energy;  // effective samples in a texel of level 0
    float n = n1 * exp2(2.0 * variance_lod);
    float y = yw.x / yw.y * push.inverse_scale;
    float sample_variance = v / yw.y / (y * y + DARK * DARK);
    // Two pseudo-samples of relative variance 1: with few samples a small variance proves nothing.
    float prior = (n * sample_variance + 2.0) / (n + 1.0);
    float of_mean = (prior + summed) / (n1 * exp2(2.0 * max(lod, 0.0)));
    // False for NaN: deviations that overflowed.
    return of_mean >= 0.0 ? of_mean : 1.0;
}

// The level of detail that noise masking asks for, in [-1, max_level].
float masked_lod(sampler2D color, sampler2D variance, vec2 texel, float lod, float variance_lod, float summed) {
    float relative = relative_variance(color, variance, texel, lod, variance_lod, summed);
    // A mean whose error is as large as itself tells nothing: as where there is no sample.
    float excess = 0.5 * log2(min(relative, 1.0) / ACCEPTED);
    float extra = excess > 0.0 ? push.noise_masking * excess : 0.0;
    return clamp(lod + extra, -1.0, push.max_level);
}
