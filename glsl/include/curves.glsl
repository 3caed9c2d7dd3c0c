// Tone curves in linear Rec.709 RGB. Reference: src/client/reference/curves.rs.

// Columns of XYZ to linear Rec.709, and the luminances of its primaries; src/color/profile.rs.
const mat3 REC709 = mat3(3.2405963, -0.9692304, 0.0556565, -1.5372059, 1.8759419, -0.20407383, -0.49855328, 0.041554492, 1.0574735);
const vec3 REC709_LUMINANCE = vec3(0.21266352, 0.71517843, 0.07215804);

// Largest luminance that a curve is given: all are flat long before.
const float MAX_TONE_INPUT = 1e6;

// Khronos PBR Neutral (specification 2024): a toe that takes off the 4 % that every surface reflects, then compression from 0.76
// of the ceiling on, colours moving to white by 0.15 per unit lost. The specification's ceiling is 1.
vec3 pbr_neutral(vec3 c, float ceiling) {
    float least = min(c.r, min(c.g, c.b));
    c -= least < 0.08 ? least * (1.0 - 6.25 * least) : 0.04;
    float peak = max(c.r, max(c.g, c.b));
    float start = 0.76 * ceiling;
    if (peak <= start) {
        return c;
    }
    float room = ceiling - start;
    float top = ceiling - room * room / (peak + room - start);
    float keep = 1.0 / (0.15 * (peak - top) + 1.0);
    return top + (c * (top / peak) - top) * keep;
}

// AgX (Sobotka 2022): inset, log2 encoding of 16.5 stops, a sigmoid, outset, display gamma 2.2. Matrices and the polynomial for the
// sigmoid: Wrensch, "Minimal AgX Implementation" (2023).
const mat3 AGX_INSET = mat3(0.842479062253094, 0.0423282422610123, 0.0423756549057051,
                            0.0784335999999992, 0.878468636469772, 0.0784336,
                            0.0792237451477643, 0.0791661274605434, 0.879142973793104);
const mat3 AGX_OUTSET = mat3(1.19687900512017, -0.0528968517574562, -0.0529716355144438,
                             -0.0980208811401368, 1.15190312990417, -0.0980434501171241,
                             -0.0990297440797205, -0.0989611768448433, 1.15107367264116);

vec3 agx(vec3 c) {
    c = log2(max(AGX_INSET * c, 1e-10));
    vec3 x = clamp((c + 12.47393) / (4.026069 + 12.47393), 0.0, 1.0);
    vec3 s = x * (x * (x * (x * (x * (15.5 * x - 40.14) + 31.96) - 6.868) + 0.4298) + 0.1191) - 0.00232;
    return pow(clamp(AGX_OUTSET * s, 0.0, 1.0), vec3(2.2));
}
