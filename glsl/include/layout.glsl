// Blocks that several shaders read from the host, member by member as in src/client/layout.rs; a block of one shader stands in it.
// tests/gpu/shaders.rs walks the compiled offsets and compares them with the Rust structs.
// A shader defines the name of the block it wants before including this file.

#ifdef SPLAT_PUSH
layout(push_constant) uniform SplatPush {
    vec2 picture;         // width and height of the picture, texels per unit of uv
    vec2 target;          // width and height of the padded target, texels
    vec2 ndc_scale;       // 2 / target
    float pad;            // texels of overscan on every side
    float inverse_scale;  // 1 / luminance scale, a power of two
} push;
#endif

#ifdef RECONSTRUCT_PUSH
layout(push_constant) uniform ReconstructPush {
    vec2 lod;             // level of detail by sample count: camera, light
    vec2 variance_lod;    // level at which colour and variance are read for noise masking
    float pad;            // texels of overscan on every side
    float light_scale;    // texels of the picture / light paths; 0 while there are none
    float noise_masking;  // Vm: levels per factor 4 of excess relative variance
    float max_level;      // coarsest level
    float energy;         // mean sum of squared weights of one splat
    float inverse_scale;  // 1 / luminance scale
    vec2 texels;          // texels of the sums per pixel drawn, along each axis
} push;
#endif

#ifdef BILATERAL_PUSH
layout(push_constant) uniform BilateralPush {
    float variance_lod;   // level at which colour and variance are read
    float noise_masking;  // Vm: stages per factor 4 of excess relative variance
    float max_level;      // coarsest level
    float energy;         // mean sum of squared weights of one splat
    float inverse_scale;  // 1 / luminance scale
} push;
#endif

#ifdef ADAPTIVE_PUSH
layout(push_constant) uniform AdaptivePush {
    ivec2 extent;         // of the level, texels
    ivec2 offset;         // of the level's first texel in the image of its light: the overscan at level 0
    int level;            // 0 has a texel per pixel
    int finest;           // levels below it keep nothing
    float inverse_scale;  // 1 / luminance scale
} push;
#endif

#ifdef GLARE_PUSH
layout(push_constant) uniform GlarePush {
    uvec2 extent;         // of the picture, pixels
    uint channel;         // X, Y or Z
} push;
#endif

#ifdef WAVELET_PUSH
layout(push_constant) uniform WaveletPush {
    ivec2 extent;         // of the picture, pixels
    int step;             // pixels between neighbours
    int padding;
} push;
#endif
